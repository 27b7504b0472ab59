"""A run kept in memory: what a recording would hold, as arrays, and written as one on demand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.recording.writer import BLOCK_NS, RecordingWriter
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]


class KeptChannel:
    """What one topic receives; made to be quick, as `ChannelBuffer` is."""

    __slots__ = ("contents", "logs", "stamps")

    def __init__(self) -> None:
        """Start with nothing."""
        self.logs: list[int] = []
        self.stamps: list[int] = []
        self.contents: list[bytes] = []

    def append(self, log_ns: int, stamp_ns: int, row: Array) -> None:
        """Keep a message: when it is recorded and valid [ns], and its row (width,), copied."""
        self.logs.append(log_ns)
        self.stamps.append(stamp_ns)
        self.contents.append(row.tobytes())

    def append_rows(self, logs_ns: list[int], stamps_ns: list[int], content: bytes) -> None:
        """Keep messages: when they are recorded and valid [ns], and the bytes of their rows."""
        self.logs += logs_ns
        self.stamps += stamps_ns
        self.contents.append(content)


class _Part(NamedTuple):
    """The messages of one topic; `rows` of a topic with rows, else `payloads`."""

    name: str
    logs: NDArray[np.int64]
    stamps: NDArray[np.int64]
    rows: Array | None
    payloads: list[bytes]


class MemoryRecorder:
    """Takes the place of a `RecordingWriter` where no file is wanted.

    Attributes:
        topics: every topic that may be recorded, by name.
        folder: None, since there is no file.
    """

    folder: Path | None = None

    def __init__(self, topics: Mapping[str, Topic]) -> None:
        """Keep messages of these topics, by name, in the order of a recording."""
        self.topics = dict(topics)
        self._channels = {name: KeptChannel() for name in topics}

    def takes(self, name: str) -> bool:
        """Return whether messages of a topic are kept."""
        return name in self._channels

    def channel(self, name: str) -> KeptChannel:
        """Return the channel of a topic.

        Raises:
            InputError: the topic was not declared.
        """
        if name not in self._channels:
            raise InputError(f"{name}: not a topic of this run, allowed: {', '.join(self.topics)}")
        return self._channels[name]

    def append_payload(self, name: str, log_ns: int, payload: bytes) -> None:
        """Keep a message of a topic without rows, such as `/diagnostics`, as its CDR bytes."""
        channel = self.channel(name)
        channel.logs.append(log_ns)
        channel.contents.append(payload)

    def close(self) -> None:
        """Do nothing: what is kept stays."""

    @property
    def counts(self) -> dict[str, int]:
        """How many messages are kept, by topic."""
        return {name: len(channel.logs) for name, channel in self._channels.items()}

    def rows(self, name: str) -> Rows:
        """Return the messages of a topic as stamps and rows, as `Recording.rows` does.

        Raises:
            InputError: no such topic, or one without rows of numbers.
        """
        channel = self.channel(name)
        if not carries_row(self.topics[name].ros_type):
            ros_type = self.topics[name].ros_type
            raise InputError(f"{name}: {ros_type} carries no row of numbers")
        # One piece from now on, so that a second call costs nothing.
        channel.contents[:] = [b"".join(channel.contents)]
        content = np.frombuffer(bytearray(channel.contents[0]))
        logs, stamps = (np.array(each, dtype=np.int64) for each in (channel.logs, channel.stamps))
        return Rows(logs, stamps, content.reshape(len(logs), self.topics[name].width))

    def write_to(self, writer: RecordingWriter) -> None:
        """Write everything, block by block as a run that is recorded while it goes on.

        Raises:
            CspmError: writing failed.
        """
        parts = [self._part(name) for name, count in self.counts.items() if count]
        last = max((int(part.logs[-1]) for part in parts), default=-1)
        for begin in range(0, last + 1, BLOCK_NS):
            for part in parts:
                first, end = np.searchsorted(part.logs, (begin, begin + BLOCK_NS)).tolist()
                if end > first:
                    _write(writer, part, first, end)

    def _part(self, name: str) -> _Part:
        channel = self._channels[name]
        logs = np.array(channel.logs, dtype=np.int64)
        if carries_row(self.topics[name].ros_type):
            rows = self.rows(name)
            return _Part(name, logs, rows.stamp_ns, rows.rows, [])
        return _Part(name, logs, logs, None, channel.contents)


def _write(writer: RecordingWriter, part: _Part, first: int, end: int) -> None:
    logs = part.logs[first:end].tolist()
    if part.rows is None:
        for log_ns, payload in zip(logs, part.payloads[first:end], strict=True):
            writer.append_payload(part.name, log_ns, payload)
        return
    stamps, content = part.stamps[first:end].tolist(), part.rows[first:end].tobytes()
    writer.channel(part.name).append_rows(logs, stamps, content)
