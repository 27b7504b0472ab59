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
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireReader


class TopicBuffer:
    """Collects payloads, and hands them to the recording's channel in blocks.

    Attributes:
        payloads: what waits to be written, in order.
        logs: log time of each [ns].
    """

    def __init__(self, topic: Topic, channel: ChannelBuffer, refuse: Callable[[str], None]) -> None:
        """Take the topic, its channel, and what reports a message that is unusable."""
        self.topic = topic
        self._layout: Layout = layout_of(topic)
        self._reader = WireReader(topic)
        self._channel = channel
        self._refuse = refuse
        self.payloads: list[bytes] = []
        self.logs: list[int] = []

    def write(self, count: int) -> None:
        """Write the first `count` messages."""
        payloads, logs = self.payloads[:count], self.logs[:count]
        del self.payloads[:count], self.logs[:count]
        if not payloads:
            return
        decoded = self._decode_all(payloads)
        if decoded is not None:
            stamps, rows = decoded[0].tolist(), decoded[1]
            for part in _within_blocks(logs):
                self._channel.append_rows(logs[part], stamps[part], rows[part].tobytes())
            return
        for log, payload in zip(logs, payloads, strict=True):
            try:
                stamp, row = self._reader.decode(payload)
            except InputError as err:
                self._refuse(str(err))
            else:
                self._channel.append(log, stamp, row)

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
