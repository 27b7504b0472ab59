"""A block of recorded time: the messages of all channels, and how they become a chunk."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import zstandard
from mcap.records import Chunk
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import Layout
from cspm_msgs_py.recording.records import HEAD, MESSAGE_PREFIX, Opcode
from cspm_msgs_py.recording.sink import Index

Bytes = NDArray[np.uint8]
Times = NDArray[np.int64]
_PREFIX = MESSAGE_PREFIX.itemsize


class Batch(NamedTuple):
    """What one channel received during a block, in order of arrival.

    Attributes:
        logs: log time of each message [ns].
        stamps: stamp of each message [ns]; empty for a channel of whole payloads.
        contents: the bytes of one or several rows in order, or the payload of each message.
    """

    logs: list[int]
    stamps: list[int]
    contents: list[bytes]


class RowRecords:
    """Makes the Message records of a channel that carries rows."""

    def __init__(self, layout: Layout, channel: int) -> None:
        """Prepare what all records of the channel share.

        Args:
            layout: layout of the channel's topic.
            channel: its id.
        """
        self._layout = layout
        self._dtype = _record_dtype(layout)
        self.template = np.zeros(self._dtype.itemsize, dtype=np.uint8)
        self.template[_PREFIX:] = layout.template
        head = self.template.view(self._dtype)[0]
        head["opcode"] = Opcode.MESSAGE
        head["length"] = len(self.template) - HEAD.size
        head["channel"] = channel

    def sizes(self, batch: Batch) -> Times:
        """Return the length of each record, shape (n,)."""
        return np.full(len(batch.logs), len(self.template), dtype=np.int64)

    def place(self, out: Bytes, starts: Times, logs: Times, sequence: int, batch: Batch) -> None:
        """Write the batch's records into a chunk's content.

        Args:
            out: the content, shape (size,).
            starts: offset of each record, shape (n,).
            logs: log times [ns], shape (n,).
            sequence: number of messages before this batch.
            batch: the messages.

        Raises:
            InputError: a row of another length, or a stamp that a ROS stamp cannot hold.
        """
        topic, count = self._layout.topic, len(logs)
        content = b"".join(batch.contents)
        if len(content) != 8 * topic.width * count:
            raise InputError(
                f"{topic.name}: a row of another length, allowed: {topic.width} float64"
            )
        bytes_ = np.repeat(self.template[None], count, axis=0)
        records = bytes_.view(self._dtype)[:, 0]
        records["sequence"] = _sequence(sequence, count)
        records["log"] = records["publish"] = logs
        rows = np.frombuffer(content).reshape(count, topic.width)
        self._layout.fill(records, _times(topic.name, batch.stamps), rows)
        size = len(self.template)
        # Row i of `windows` is the `size` bytes from offset i on, so one assignment places all.
        windows = np.ndarray((len(out) - size + 1, size), np.uint8, out, strides=(1, 1))
        windows[starts] = bytes_


class PayloadRecords:
    """Makes the Message records of a channel whose payloads are given."""

    def __init__(self, channel: int) -> None:
        """Remember the channel's id."""
        self._channel = channel

    def sizes(self, batch: Batch) -> Times:
        """Return the length of each record, shape (n,)."""
        return np.array([_PREFIX + len(payload) for payload in batch.contents], dtype=np.int64)

    def place(self, out: Bytes, starts: Times, logs: Times, sequence: int, batch: Batch) -> None:
        """Write the batch's records into a chunk's content; see `RowRecords.place`."""
        prefix = np.zeros(len(logs), dtype=MESSAGE_PREFIX)
        prefix["opcode"] = Opcode.MESSAGE
        prefix["length"] = self.sizes(batch) - HEAD.size
        prefix["channel"] = self._channel
        prefix["sequence"] = _sequence(sequence, len(logs))
        prefix["log"] = prefix["publish"] = logs
        for start, head, payload in zip(starts.tolist(), prefix, batch.contents, strict=True):
            record = head.tobytes() + payload
            out[start : start + len(record)] = np.frombuffer(record, dtype=np.uint8)


class BlockPart(NamedTuple):
    """The batch of one channel, its id, the messages it had before, and its record maker."""

    channel: int
    name: str
    sequence: int
    batch: Batch
    records: RowRecords | PayloadRecords


def merge(parts: Sequence[BlockPart]) -> tuple[bytes, dict[int, Index]]:
    """Return a chunk's content, ordered by log time, and the index of each channel.

    Messages of one log time are ordered by channel, those of one channel by arrival: the content
    does not depend on how the channels' appends were interleaved.

    Raises:
        InputError: a time or a row that a recording cannot hold.
    """
    logs = np.concatenate([_log_times(part) for part in parts])
    sizes = np.concatenate([part.records.sizes(part.batch) for part in parts])
    order = np.argsort(logs, kind="stable")
    starts = np.empty(len(logs), dtype=np.int64)
    starts[order] = np.cumsum(sizes[order]) - sizes[order]
    entries = np.stack([logs, starts], axis=1).astype("<u8")
    out = np.empty(int(sizes.sum()), dtype=np.uint8)
    index, first = {}, 0
    for part in parts:
        own = slice(first, first + len(part.batch.logs))
        part.records.place(out, starts[own], logs[own], part.sequence, part.batch)
        index[part.channel] = _in_order(entries[own])
        first = own.stop
    return out.tobytes(), index


def compress(
    content: bytes, index: dict[int, Index], compressor: zstandard.ZstdCompressor
) -> Chunk:
    """Return merged content as a compressed chunk."""
    return Chunk(
        compression="zstd",
        data=compressor.compress(content),
        message_start_time=min(int(entries[0, 0]) for entries in index.values()),
        message_end_time=max(int(entries[-1, 0]) for entries in index.values()),
        uncompressed_crc=zlib.crc32(content),
        uncompressed_size=len(content),
    )


def _record_dtype(layout: Layout) -> np.dtype[np.void]:
    """Return the structure of a Message record: its prefix and the layout's fields."""
    fields = dict(layout.dtype.fields or {})
    names = list(MESSAGE_PREFIX.names or ()) + list(fields)
    prefix = dict(MESSAGE_PREFIX.fields or {})
    return np.dtype(
        {
            "names": names,
            "formats": [f[0] for f in prefix.values()] + [f[0] for f in fields.values()],
            "offsets": [f[1] for f in prefix.values()] + [_PREFIX + f[1] for f in fields.values()],
            "itemsize": _PREFIX + layout.size,
        }
    )


def _sequence(first: int, count: int) -> Times:
    return np.arange(first, first + count) & 0xFFFF_FFFF


def _times(name: str, times: list[int]) -> Times:
    try:
        return np.array(times, dtype=np.int64)
    except OverflowError:
        raise InputError(f"{name}: a time beyond ±{2**63 - 1} ns") from None


def _log_times(part: BlockPart) -> Times:
    logs = _times(part.name, part.batch.logs)
    if logs.min() < 0:
        raise InputError(f"{part.name}: log time {logs.min()} ns, allowed: 0 or later")
    return logs


def _in_order(entries: Index) -> Index:
    """Return a channel's index entries by offset, hence by log time."""
    starts = entries[:, 1]
    return entries if (starts[1:] > starts[:-1]).all() else entries[np.argsort(starts)]
