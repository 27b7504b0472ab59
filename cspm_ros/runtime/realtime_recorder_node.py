"""The recorder's node in real time; where there is no simulated plant it leads the run."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from itertools import cycle
from typing import TYPE_CHECKING

from cspm_msgs_py.diagnostics import Level, Status, decode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import RECORDER, Edges
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.bound_flag import read_flag
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.fault_line import FaultLine
from cspm_msgs_py.ros.graph_publishers import GraphPublishers, bind, census_of
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import DIAGNOSTICS_RATE, FORCE_CONTROLLER
from cspm_msgs_py.stepping.admission import Admission
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS, SAFE, Topic
from cspm_ros.runtime.topic_buffer import TopicBuffer

if TYPE_CHECKING:
    from cspm_ros.check_drivers.driver_statics import DriverStatics

_LISTENING = "a second of each driver's messages"
_TAKE_EVERY_S = 0.01
_WRITE_EVERY_S = 0.02
_LOOK_EVERY_S = 0.2


class RealtimeRecorderNode:
    """Writes what comes, with the time at which it came.

    What does not count in the run is written as it came, on topics of its own, and reported.

    Attributes:
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        node: ContractNode,
        period_ns: int,
        topics: Mapping[str, Topic],
        edges: Mapping[str, Edges],
        writer: RecordingWriter,
    ) -> None:
        """Connect the recording to its topics; `period_ns` is the plant's."""
        self._writer, self._edges, self._topics = writer, edges, topics
        self._node, self._period_ns = node, period_ns
        node.keep_time()
        self._intake = Intake(node.node)
        self._buffers: dict[str, TopicBuffer] = {}
        self._came: set[str] = set()
        self._safe = self._begun = False
        self.refused = (0, "")
        self._line = FaultLine(node)
        for name, topic in topics.items():
            self._subscribe(name, topic)
        self._leader: FollowerSide | Leader | None = None
        self._statics: DriverStatics | None = None
        node.every(_TAKE_EVERY_S, self._intake.take)
        # One topic after the other: all at once would keep other nodes of the process waiting.
        self._next = cycle(self._buffers.values())
        node.every(_WRITE_EVERY_S / len(self._buffers), self._write_next)
        self._publish_status = node.status_publisher()
        node.every(1.0 / DIAGNOSTICS_RATE, self._tell)

    def follow(self) -> None:
        """Start and end with the plant."""
        self._leader = FollowerSide(self._node, self._period_ns, on_start=self._begin)

    def lead(
        self,
        others: Collection[str],
        needed: Collection[str],
        duration_ns: int,
        patience_s: float,
        statics: DriverStatics,
    ) -> Leader:
        """Start the run once `others` and a message of each of the topics `needed` are there.

        And once `statics`, which hears them, has found no error. Its `InputError` ends the session,
        and so does that of drivers that are there without a start for longer than `patience_s` [s].
        """
        bound = [topic for topic in self._topics.values() if carries_row(topic.ros_type)]
        excess = census_of(self._node, bound, self._edges)
        self._statics = statics

        def missing() -> list[str]:
            absent = [*(name for name in needed if name not in self._came), *excess()]
            if absent:
                statics.restart()
            return absent or [_LISTENING] * statics.waits()

        self._leader = Leader(
            self._node,
            self._period_ns,
            others,
            duration_ns,
            missing=missing,
            on_start=self._begin,
        )
        self._wait_for_drivers(self._leader, needed, patience_s)
        return self._leader

    def _wait_for_drivers(self, leader: Leader, needed: Collection[str], patience_s: float) -> None:
        """Give the start up where drivers are there and do not fit."""
        # Asks the graph, which a run with a simulated plant has no need of.
        from cspm_ros.check_drivers.driver_patience import DriverPatience

        patience = DriverPatience(self._node, [self._topics[name] for name in needed], patience_s)

        def look() -> None:
            silent = [name for name in needed if name not in self._came]
            patience.look("" if leader.busy else leader.waits(), silent)

        self._node.every(_LOOK_EVERY_S, look)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._leader is not None and self._leader.end_ns is not None

    def close(self) -> None:
        """Write what came, and leave the topics."""
        self._intake.take()
        for buffer in self._buffers.values():
            buffer.write()
        self._intake.close()

    def _begin(self, _: int) -> None:
        self._begun = True

    def _subscribe(self, name: str, topic: Topic) -> None:
        message_class = ros_class(topic.ros_type)
        if not carries_row(topic.ros_type):
            of_guard = name in (BRAKE.name, SAFE.name)
            take = self._take_flag(topic) if of_guard else partial(self._take_other, name)
            self._intake.subscribe_tagged(topic, message_class, take)
            return
        buffer = self._buffers[name] = self._buffer(topic)

        def take_row(message: Tagged) -> None:
            self._came.add(name)
            if self._statics is not None:
                self._statics.hear(name, message.received_ns, message.payload)
            buffer.add(message)

        self._intake.subscribe_tagged(topic, message_class, take_row, store=buffer)

    def _buffer(self, topic: Topic) -> TopicBuffer:
        """Return what collects a topic's rows, and knows which count."""
        name, node = topic.name, self._node
        binding = bind(node, topic, self._edges)
        admission = Admission(name)

        def stranger(gid: bytes | None) -> str | None:
            now_ns = node.now_ns()
            return binding.fault_if_known(gid, now_ns, begun=self._begun, safe=self._lenient)

        def fault(stamp_ns: int) -> str | None:
            return admission.fault(stamp_ns, node.now_ns(), safe=self._lenient)

        def own() -> bytes | None:
            return binding.bound if self._begun else None

        channel, refuse = self._writer.channel(name), partial(self._refuse_row, name)
        return TopicBuffer(topic, channel, refuse, stranger, fault, own)

    @property
    def _lenient(self) -> bool:
        """Whether clocks and publishers may change: before the run, and in the safe state."""
        return self._safe or not self._begun

    def _take_flag(self, topic: Topic) -> Callable[[Tagged], None]:
        """Return what takes a flag of the force controller, and nobody else's."""
        name, node = topic.name, self._node
        publishers = GraphPublishers(node.node, topic)
        binding = PublisherBinding(name, [FORCE_CONTROLLER], publishers)

        def take(message: Tagged) -> None:
            log_ns, payload = message.received_ns, message.payload
            fault = binding.fault_if_known(message.gid, node.now_ns(), begun=self._begun, safe=True)
            try:
                flag = read_flag(name, payload)
            except InputError as err:
                fault = fault or str(err)
            if fault is not None:
                self._refuse_row(name, log_ns, payload, fault)
                return
            self._safe = flag if name == SAFE.name else self._safe
            self._writer.append_payload(name, log_ns, payload)

        return take

    def _take_other(self, name: str, message: Tagged) -> None:
        log_ns, payload = message.received_ns, message.payload
        try:
            if name == DIAGNOSTICS.name:
                decode_diagnostics(payload)
        except InputError as err:
            self._writer.append_refused(name, log_ns, payload)
            self._refuse(f"{name}: {err}")
        else:
            self._writer.append_payload(name, log_ns, payload)

    def _tell(self) -> None:
        fault = self._node.clock_fault()
        if fault is not None:
            self._line.report(fault)
        lost = sum(self._intake.lost.values())
        values = {"lost": str(lost), "refused": str(self.refused[0])}
        trouble = "messages lost" if lost else f"refused: {self.refused[1]}"
        bad = lost or self.refused[0]
        status = Status(Level.WARN if bad else Level.OK, RECORDER, trouble if bad else "ok", values)
        self._publish_status(self._node.now_ns(), status)

    def _write_next(self) -> None:
        next(self._next).write()

    def _refuse_row(self, name: str, log_ns: int, payload: bytes, reason: str) -> None:
        self._writer.append_refused(name, log_ns, payload)
        self._refuse(reason)
        if self._begun:
            self._line.report(reason)

    def _refuse(self, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
