"""The recorder's node in lockstep."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.own_senders import OwnSenders
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import CLOCK, Schedule
from cspm_msgs_py.stepping.lockstep import RECORDED_EVERY
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_ros.runtime.lockstep_recorder import LockstepRecorder

_LOOK_EVERY_S = 0.004


class RecorderNode:
    """Subscribes to everything that the schedule names, and writes it."""

    def __init__(
        self,
        node: ContractNode,
        schedule: Schedule,
        topics: Mapping[str, Topic],
        writer: RecordingWriter,
        reporting: Collection[str],
        own: Collection[str] = (),
    ) -> None:
        """Connect the recording to the run's topics.

        `reporting` nodes send their statuses themselves; `own` ones, programs of the user's, none.
        """
        self._node = node
        senders = OwnSenders(node, schedule, own, schedule.topics)
        self._plant = FollowerSide(node, schedule.period_ns, self._end, ready=senders.ready)
        self._recorder = LockstepRecorder(
            schedule, dict(topics), writer, self._plant.report, node.complain, reporting, own
        )
        self._intake = Intake(node.node)
        for name in schedule.topics:
            if name != CLOCK:
                receiver = self._recorder.receiver(name)
                self._intake.subscribe_due(topics[name], ros_class(topics[name].ros_type), receiver)
        self._intake.subscribe(
            DIAGNOSTICS,
            ros_class(DIAGNOSTICS.ros_type),
            self._recorder.receive_diagnostics,
            numbered=False,
            depth=None,
        )
        self._receive_clock = self._recorder.receiver(CLOCK).receive
        self._ticks: list[bytes] = []
        self._numbers: list[int | None] = []
        self._ticked = self._looked = 0
        self._clock = node.intake or Intake(node.node)
        self._clock.subscribe_blocks(topics[CLOCK], ros_class(topics[CLOCK].ros_type), self._tick)
        node.every(_LOOK_EVERY_S, self._look)

    @property
    def ended(self) -> bool:
        """Whether the run ended and all of it is written."""
        return self._recorder.done

    @property
    def progress(self) -> int:
        """The plant step through which everything came."""
        return self._recorder.completed

    @property
    def refused(self) -> tuple[int, str]:
        """How many messages were unusable, and why the last was."""
        return self._recorder.refused

    def _tick(self, payloads: list[bytes], numbers: list[int | None]) -> None:
        """Count the steps by the clock, and take all else in blocks of many steps."""
        self._ticks += payloads
        self._numbers += numbers
        self._ticked += len(payloads)
        if len(self._ticks) >= RECORDED_EVERY:
            self._take_all()

    def _look(self) -> None:
        """Take what there is of a block while the clock is stopped."""
        self._clock.take()
        if self._ticked == self._looked:
            self._take_all()
        self._looked = self._ticked

    def _take_all(self) -> None:
        ticks, numbers = self._ticks, self._numbers
        self._ticks, self._numbers = [], []
        try:
            if ticks:
                self._receive_clock(ticks, numbers)
            self._intake.take()
        except CspmError as err:
            self._node.fail(str(err))

    def close(self) -> None:
        """Write all whole steps that came, and leave the topics."""
        self._clock.take()
        self._take_all()
        self._clock.close()
        self._intake.close()
        self._recorder.write_whole()

    def waiting(self) -> str:
        """Return what the recorder waits for."""
        return f"recorder waits for {', '.join(self._recorder.missing())}"

    def _end(self, last_step: int) -> None:
        self._recorder.end(last_step)
