"""The recorder's node in lockstep."""

from __future__ import annotations

from collections.abc import Mapping

from cspm_bringup.gatherer import Gatherer
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import CLOCK, Schedule
from cspm_msgs_py.topics import DIAGNOSTICS, Topic

_TAKE_EVERY_S = 0.002
_TAKE_EVERY_STEPS = 4


class RecorderNode:
    """Subscribes to everything that the schedule names, and writes it."""

    def __init__(
        self,
        node: ContractNode,
        schedule: Schedule,
        topics: Mapping[str, Topic],
        writer: RecordingWriter,
    ) -> None:
        """Connect the recording to the run's topics."""
        self._plant = FollowerSide(node, schedule.period_ns, self._end)
        self._gatherer = Gatherer(schedule, dict(topics), writer, self._plant.tell, node.complain)
        self._intake = Intake(node.node)
        for name in schedule.topics:
            receive = self._gatherer.receive(name)
            self._intake.subscribe(topics[name], ros_class(topics[name].ros_type), receive)
        self._intake.subscribe(
            DIAGNOSTICS,
            ros_class(DIAGNOSTICS.ros_type),
            self._gatherer.receive_diagnostics,
            numbered=False,
        )
        if node.intake is not None:
            # Everything of a step is there when the next one begins.
            node.subscribe(topics[CLOCK], self._take)
        node.every(_TAKE_EVERY_S, self._intake.take)
        self._ticks = 0

    @property
    def ended(self) -> bool:
        """Whether the run ended and all of it is written."""
        return self._gatherer.done

    @property
    def progress(self) -> int:
        """The plant step through which everything came."""
        return self._gatherer.completed

    @property
    def refused(self) -> tuple[int, str]:
        """How many messages were unusable, and why the last was."""
        return self._gatherer.refused

    def _take(self, _: bytes) -> None:
        self._ticks += 1
        if self._ticks % _TAKE_EVERY_STEPS == 0:
            self._intake.take()

    def close(self) -> None:
        """Write all whole steps that came, and leave the topics."""
        self._intake.take()
        self._intake.close()
        self._gatherer.write_whole()

    def waiting(self) -> str:
        """Return what the recorder waits for."""
        return f"recorder waits for {', '.join(self._gatherer.missing())}"

    def _end(self, last_step: int) -> None:
        self._gatherer.end(last_step)
