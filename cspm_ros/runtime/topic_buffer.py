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
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireReader

# What comes in a tenth of a second at 2 kHz; it is written more often.
_MOST_ROWS = 200


class TopicBuffer:
    """Collects messages, and hands them to the recording's channel in blocks.

    What does not count is handed on as it came. Rows of the topic's own publisher are stored as
    such; a message that comes as bytes has them written first.
    """

    def __init__(
        self,
        topic: Topic,
        channel: ChannelBuffer,
        refuse: Callable[[int, bytes, str], None],
        stranger: Callable[[bytes | None], str | None] = lambda _: None,
        fault: Callable[[int], str | None] = lambda _: None,
        own: Callable[[], bytes | None] = lambda: None,
    ) -> None:
        """Take where the messages of a topic go.

        Args:
            topic: the topic.
            channel: its channel.
            refuse: gets log time [ns], bytes and reason of a message that does not count.
            stranger: notes a message of a publisher, by its identity; returns why it does not
                count, None if it does.
            fault: returns why a message of this stamp [ns] does not count.
            own: returns the identity of the publisher whose messages count, None if unknown.
        """
        self.topic = topic
        self._layout: Layout = layout_of(topic)
        self._reader = WireReader(topic)
        self._channel = channel
        self._refuse, self._stranger, self._fault = refuse, stranger, fault
        self._own = own
        self._latest = 0
        self._payloads: list[bytes] = []
        self._logs: list[int] = []
        self._times = np.empty((_MOST_ROWS, 2), dtype=np.int64)
        self._rows = np.empty((_MOST_ROWS, topic.width))
        self._used = 0

    @property
    def publisher(self) -> bytes | None:
        """Whose messages are stored without a look at each (16 bytes); None: nobody's."""
        return self._own()

    def room(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return where the next go: stamps and times of reception [ns], (n, 2), rows, (n, width).

        There is room for one at least.
        """
        if self._payloads or self._used == _MOST_ROWS:
            self.write()
        return self._times[self._used :], self._rows[self._used :]

    def stored(self, count: int) -> None:
        """Note that so many were put there."""
        self._used += count
        self._stranger(self._own())

    def add(self, message: Tagged) -> None:
        """Take a message."""
        strange = self._stranger(message.gid)
        if strange is not None:
            self._refuse(message.received_ns, message.payload, strange)
            return
        if self._used:
            self.write()
        self._payloads.append(message.payload)
        self._logs.append(message.received_ns)

    def write(self) -> None:
        """Write what was collected."""
        if self._used:
            stamps, logs = self._times[: self._used].T
            rows, self._used = self._rows[: self._used], 0
            if not self._write_rows(logs.tolist(), stamps, rows):
                payloads = [each.tobytes() for each in self._layout.encode(stamps, rows)]
                self._write_each(logs.tolist(), payloads)
        if self._payloads:
            payloads, self._payloads = self._payloads, []
            taken, self._logs = self._logs, []
            decoded = self._decode_all(payloads)
            if decoded is None or not self._write_rows(taken, *decoded):
                self._write_each(taken, payloads)

    def _write_rows(
        self, logs: list[int], stamps: NDArray[np.int64], rows: NDArray[np.float64]
    ) -> bool:
        """Write messages if all count; return whether they do."""
        if not self._in_order(stamps):
            return False
        times = stamps.tolist()
        for part in _within_blocks(logs):
            self._channel.append_rows(logs[part], times[part], rows[part].tobytes())
        return True

    def _write_each(self, logs: list[int], payloads: list[bytes]) -> None:
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
