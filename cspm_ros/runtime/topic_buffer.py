"""One topic's messages on their way from the wire into a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import Layout, layout_of
from cspm_msgs_py.recording.channel_buffer import ChannelBuffer
from cspm_msgs_py.recording.writer import BLOCK_NS
from cspm_msgs_py.ros.tagged_taker import Tagged
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireReader


class TopicBuffer:
    """Collects payloads, and hands them to the recording's channel in blocks.

    What does not count is handed on as it came.

    Attributes:
        payloads: what waits to be written, in order.
        logs: log time of each [ns].
    """

    def __init__(
        self,
        topic: Topic,
        channel: ChannelBuffer,
        refuse: Callable[[int, bytes, str], None],
        stranger: Callable[[bytes | None], str | None] = lambda _: None,
        fault: Callable[[int], str | None] = lambda _: None,
    ) -> None:
        """Take where the messages of a topic go.

        Args:
            topic: the topic.
            channel: its channel.
            refuse: gets log time [ns], bytes and reason of a message that does not count.
            stranger: returns why messages of a publisher do not count, by its identity.
            fault: returns why a message of this stamp [ns] does not count.
        """
        self.topic = topic
        self._layout: Layout = layout_of(topic)
        self._reader = WireReader(topic)
        self._channel = channel
        self._refuse, self._stranger, self._fault = refuse, stranger, fault
        self._latest = 0
        self.payloads: list[bytes] = []
        self.logs: list[int] = []

    def add(self, message: Tagged) -> None:
        """Take a message."""
        strange = self._stranger(message.gid)
        if strange is not None:
            self._refuse(message.received_ns, message.payload, strange)
            return
        self.payloads.append(message.payload)
        self.logs.append(message.received_ns)

    def write(self, count: int) -> None:
        """Write the first `count` messages."""
        payloads, logs = self.payloads[:count], self.logs[:count]
        del self.payloads[:count], self.logs[:count]
        if not payloads:
            return
        decoded = self._decode_all(payloads)
        if decoded is not None and self._in_order(decoded[0]):
            stamps, rows = decoded[0].tolist(), decoded[1]
            for part in _within_blocks(logs):
                self._channel.append_rows(logs[part], stamps[part], rows[part].tobytes())
            return
        for log, payload in zip(logs, payloads, strict=True):
            self._write_one(log, payload)

    def _write_one(self, log_ns: int, payload: bytes) -> None:
        try:
            stamp, row = self._reader.decode(payload)
        except InputError as err:
            self._refuse(log_ns, payload, str(err))
            return
        fault = self._fault(stamp)
        if fault is not None:
            self._refuse(log_ns, payload, fault)
            return
        self._latest = stamp
        self._channel.append(log_ns, stamp, row)

    def _in_order(self, stamps: NDArray[np.int64]) -> bool:
        """Return whether stamps go on from those before, and the last one counts."""
        before, last = self._latest, int(stamps[-1])
        if stamps[0] < before or (np.diff(stamps) < 0).any() or self._fault(last) is not None:
            return False
        self._latest = last
        return True

    def _decode_all(
        self, payloads: list[bytes]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
        """Return stamps and rows of messages that all have the canonical bytes, else None."""
        content = b"".join(payloads)
        size = self._layout.size
        if len(content) != size * len(payloads) or any(len(p) != size for p in payloads):
            return None
        block = np.frombuffer(content, dtype=np.uint8).reshape(-1, size)
        if not self._layout.matches(block).all():
            return None
        # Whatever the numbers are: that one is not finite is what somebody will look for here.
        return self._layout.decode(block)


def _within_blocks(logs_ns: list[int]) -> Iterator[slice]:
    """Yield stretches of log times [ns] that are of one block of the recording."""
    first = 0
    for _, group in groupby(logs_ns, key=lambda log: log // BLOCK_NS):
        last = first + sum(1 for _ in group)
        yield slice(first, last)
        first = last
