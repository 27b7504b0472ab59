"""The recorder's node in real time; where there is no simulated plant it leads the run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import cycle

from cspm_msgs_py.diagnostics import Level, Status, decode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import DIAGNOSTICS_RATE
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_ros.runtime.topic_buffer import TopicBuffer

_TAKE_EVERY_S = 0.002
_WRITE_EVERY_S = 0.02


class RealtimeRecorderNode:
    """Writes what comes, with the time at which it came.

    Attributes:
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        node: ContractNode,
        period_ns: int,
        topics: Mapping[str, Topic],
        writer: RecordingWriter,
    ) -> None:
        """Connect the recording to its topics; `period_ns` is the plant's."""
        self._writer = writer
        self._intake = Intake(node.node)
        self._buffers: dict[str, TopicBuffer] = {}
        self._came: set[str] = set()
        self.refused = (0, "")
        for name, topic in topics.items():
            self._subscribe(name, topic)
        self._leader: FollowerSide | Leader | None = None
        self._node, self._period_ns = node, period_ns
        node.every(_TAKE_EVERY_S, self._intake.take)
        # One topic after the other: all at once would keep other nodes of the process waiting.
        self._next = cycle(self._buffers.values())
        node.every(_WRITE_EVERY_S / len(self._buffers), self._write_next)
        self._publish_status = node.status_publisher()
        node.every(1.0 / DIAGNOSTICS_RATE, self._tell)

    def follow(self) -> None:
        """Start and end with the plant."""
        self._leader = FollowerSide(self._node, self._period_ns)

    def lead(self, others: Collection[str], needed: Collection[str], duration_ns: int) -> Leader:
        """Start the run once `others` and a message of each of the topics `needed` are there."""
        self._leader = Leader(
            self._node,
            self._period_ns,
            others,
            duration_ns,
            missing=lambda: [name for name in needed if name not in self._came],
        )
        return self._leader

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._leader is not None and self._leader.end_ns is not None

    def close(self) -> None:
        """Write what came, and leave the topics."""
        self._intake.take()
        for buffer in self._buffers.values():
            buffer.write(len(buffer.payloads))
        self._intake.close()

    def _subscribe(self, name: str, topic: Topic) -> None:
        message_class = ros_class(topic.ros_type)
        if not carries_row(topic.ros_type):

            def keep(payload: bytes, log_ns: int, _: int | None) -> None:
                if name == DIAGNOSTICS.name and not self._looks_right(payload):
                    return
                self._writer.append_payload(name, log_ns, payload)

            self._intake.subscribe(topic, message_class, keep, numbered=False)
            return
        buffer = TopicBuffer(topic, self._writer.channel(name), self._refuse)
        self._buffers[name] = buffer

        def take(payload: bytes, log_ns: int, _: int | None) -> None:
            self._came.add(name)
            buffer.payloads.append(payload)
            buffer.logs.append(log_ns)

        self._intake.subscribe(topic, message_class, take)

    def _tell(self) -> None:
        lost = sum(self._intake.lost.values())
        values = {"lost": str(lost), "refused": str(self.refused[0])}
        trouble = "messages lost" if lost else f"refused: {self.refused[1]}"
        bad = lost or self.refused[0]
        status = Status(Level.WARN if bad else Level.OK, RECORDER, trouble if bad else "ok", values)
        self._publish_status(self._node.now_ns(), status)

    def _write_next(self) -> None:
        buffer = next(self._next)
        buffer.write(len(buffer.payloads))

    def _looks_right(self, payload: bytes) -> bool:
        try:
            decode_diagnostics(payload)
        except InputError as err:
            self._refuse(f"{DIAGNOSTICS.name}: {err}")
            return False
        return True

    def _refuse(self, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
