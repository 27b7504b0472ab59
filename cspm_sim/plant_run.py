"""A run as its plant's node sees it: machine, sensors, and who reads what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cspm_model.motion import Motion
from cspm_msgs_py.graph import Edges
from cspm_msgs_py.schedule import PLANT, Schedule
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_sim.any_plant import AnyPlant
from cspm_sim.faults import Faults
from cspm_sim.sensors import AnySensor
from cspm_sim.simulator import Publish, Simulator


@dataclass(frozen=True)
class PlantRun:
    """What the plant's node is made of, in lockstep and in real time.

    Attributes:
        plant: the machine.
        sensors: by topic.
        schedule: of the run.
        steps: how many plant steps to make.
        edges: who sends and reads what in this run, by topic.
        nodes: the nodes of this run.
        controlled: whether a closed loop is to keep the bar upright.
        target: the motion of the target where it is measured.
        faults: what fails, if anything can.
    """

    plant: AnyPlant
    sensors: Mapping[str, AnySensor]
    schedule: Schedule
    steps: int
    edges: Mapping[str, Edges]
    nodes: tuple[str, ...]
    controlled: bool
    target: Motion | None = None
    faults: Faults | None = None

    @property
    def topics(self) -> dict[str, Topic]:
        """The machine's topics, by name."""
        return self.plant.testbed.topics

    @property
    def others(self) -> list[str]:
        """The nodes of this run but the plant."""
        return [name for name in self.nodes if name != PLANT]

    @property
    def published(self) -> dict[str, Edges]:
        """Topics that the plant alone sends, without diagnostics."""
        return {
            name: edge
            for name, edge in self.edges.items()
            if edge.senders == (PLANT,) and name != DIAGNOSTICS.name
        }

    @property
    def sent(self) -> list[Topic]:
        """Topics that one node of this run sends, each alone."""
        return [self.topics[name] for name, edge in self.edges.items() if len(edge.senders) == 1]

    def simulator(self, publish: Mapping[str, Publish]) -> Simulator:
        """Return plant and sensors; `publish` says where messages go, by topic."""
        return Simulator(
            self.plant,
            self.sensors,
            publish,
            period_ns=self.schedule.period_ns,
            controlled=self.controlled,
            target=self.target,
            faults=self.faults,
        )
