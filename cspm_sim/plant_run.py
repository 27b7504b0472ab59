"""A run as its plant's node sees it: machine, sensors, and who reads what."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_model.motion import Motion
from cspm_msgs_py.graph import Edges
from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT, Schedule
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_sim.any_plant import AnyPlant
from cspm_sim.faults import Faults
from cspm_sim.sensors import AnySensor
from cspm_sim.simulator import Publish, Simulator

Array = NDArray[np.float64]


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
        link: to the controller inside the drives; None: it is a node of its own.
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
    link: DriveLink | None = None

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

    def simulator(self, publish: Mapping[str, Publish], start_ns: Callable[[], int]) -> Simulator:
        """Return plant and sensors.

        Args:
            publish: where messages go, by topic.
            start_ns: returns the instant of the first state [ns].
        """
        if self.link is not None:
            read = self.schedule.nodes[FORCE_CONTROLLER]
            inner = {*read.inputs, *read.held} & publish.keys()
            publish = {
                name: self._tapped(self.link, name, send, start_ns) if name in inner else send
                for name, send in publish.items()
            }
        return Simulator(
            self.plant,
            self.sensors,
            publish,
            period_ns=self.schedule.period_ns,
            controlled=self.controlled,
            target=self.target,
            faults=self.faults,
        )

    def _tapped(
        self, link: DriveLink, topic: str, send: Publish, start_ns: Callable[[], int]
    ) -> Publish:
        """Return what publishes, and hands the drives what they measure as well."""

        def publish(log_ns: int, stamp_ns: int, row: Array) -> None:
            send(log_ns, stamp_ns, row)
            link.measure(topic, stamp_ns + start_ns(), row)

        return publish
