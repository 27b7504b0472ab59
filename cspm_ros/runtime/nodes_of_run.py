"""What the nodes of a run have in common, in lockstep and in real time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cspm_model.scene.urdf import urdf
from cspm_msgs_py.graph import Edges, graph_of, inside
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.domain_claim import START
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.schedule import TENSION, Schedule, schedule_of
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.topics import Topic
from cspm_ros.runtime.robot_description import publish_description
from cspm_run.assembly import assemble_simulator, faults_of
from cspm_run.bundle import Bundle
from cspm_sim.plant_run import PlantRun


@dataclass(frozen=True)
class NodesOfRun:
    """A run whose nodes are to be made.

    Attributes:
        bundle: what to run, resolved.
        members: names of the nodes that take part.
        own: those of them that are programs of the user's: they send what the schedule names, and
            neither announce themselves nor report.
    """

    bundle: Bundle
    members: tuple[str, ...]
    own: tuple[str, ...] = ()

    @property
    def schedule(self) -> Schedule:
        """The run's schedule, of which real time takes rates and delays."""
        return schedule_of(self.bundle.scenario, self.bundle.testbed.testbed)

    @property
    def edges(self) -> Mapping[str, Edges]:
        """Who sends and reads what, by topic."""
        return graph_of(self.schedule, self.members)

    @property
    def testbed_topics(self) -> dict[str, Topic]:
        """All topics of the machine, by name."""
        return self.bundle.testbed.testbed.topics

    def name_machine(self, node: ContractNode) -> None:
        """Have a node name the machine in what it reports."""
        node.hardware_id = self.bundle.testbed.testbed.name

    def claim(self, node: ContractNode) -> None:
        """Claim the ROS domain for this run, in the name of the node that leads it.

        It says from now on what the machine looks like.

        Raises:
            InputError: another run has it.
        """
        if node.claim(self.bundle.scenario.name, START):
            publish_description(node, urdf(self.bundle.testbed.testbed))

    @property
    def stages(self) -> tuple[str, ...]:
        """The controllers that take part."""
        return tuple(name for name in self.schedule.nodes if name in self.members)

    def link(self) -> DriveLink | None:
        """Return what joins plant and force controller where that is part of it, else None."""
        return DriveLink(TENSION) if self.hosted else None

    @property
    def hosted(self) -> tuple[str, ...]:
        """The nodes that are made with the plant, in its process."""
        schedule = self.schedule
        return tuple(n for n in schedule.hosted if inside(schedule, n, self.members))

    def plant_run(
        self, steps: int, place: Path, link: DriveLink | None = None, *, realtime: bool = False
    ) -> PlantRun:
        """Return what the plant's node is made of.

        Args:
            steps: how many plant steps to make.
            place: where the bundle is unpacked.
            link: to the controller inside the drives, if it is there.
            realtime: whether the run is one in real time, into which faults may be put.
        """
        scenario, testbed = self.bundle.scenario, self.bundle.testbed.testbed
        plant, sensors, target = assemble_simulator(scenario, testbed, place, self.bundle.plant)
        return PlantRun(
            plant=plant,
            sensors=sensors,
            schedule=self.schedule,
            steps=steps,
            edges=self.edges,
            nodes=tuple(name for name in self.members if name not in self.own),
            controlled=isinstance(scenario.control, ClosedLoop),
            target=target,
            faults=faults_of(scenario, testbed, self.bundle.plant, realtime=realtime),
            link=link,
        )
