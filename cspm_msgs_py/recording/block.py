"""A block of recorded time: the messages of all channels, and how they become a chunk."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

import numpy as np
import zstandard
from mcap.records import Chunk
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import Layout, split_stamps
from cspm_msgs_py.recording.records import HEAD, MESSAGE_PREFIX, Opcode
from cspm_msgs_py.recording.sink import Index

Bytes = NDArray[np.uint8]
Times = NDArray[np.int64]
_PREFIX = MESSAGE_PREFIX.itemsize
_STAMP = np.dtype([("sec", "<i4"), ("nanosec", "<u4")])


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


class BlockPart(NamedTuple):
    """A channel's part of a block.

    Attributes:
        channel: its id.
        name: its topic.
        sequence: how many messages it had before.
        batch: its messages.
        layout: of its rows; None where payloads are given.
    """

    channel: int
    name: str
    sequence: int
    batch: Batch
    layout: Layout | None


def merge(
    parts: Sequence[BlockPart], place_rows: Callable[..., None]
) -> tuple[bytes, dict[int, Index]]:
    """Return a chunk's content, ordered by log time, and the index of each channel.

    Messages of one log time are ordered by channel, those of one channel by arrival: the content
    does not depend on how the channels' appends were interleaved. `place_rows` is the kernel of
    `row_kernel`, which readers need not load.

    Raises:
        InputError: a time or a row that a recording cannot hold.
    """
    counts = [len(part.batch.logs) for part in parts]
    logs, sizes = _log_times(parts), _sizes(parts, counts)
    order = np.argsort(logs, kind="stable")
    starts = np.empty(len(logs), dtype=np.int64)
    starts[order] = np.cumsum(sizes[order]) - sizes[order]
    out = np.empty(int(sizes.sum()), dtype=np.uint8)
    heads = _heads(parts, counts, sizes, logs)
    of_rows: NDArray[np.bool_] = np.repeat([part.layout is not None for part in parts], counts)
    with_rows = [part for part in parts if part.layout is not None]
    if with_rows:
        place_rows(out, starts[of_rows], *_row_data(heads[of_rows], with_rows))
    _place_payloads(out, starts[~of_rows], heads[~of_rows], parts)
    return out.tobytes(), _index(parts, counts, logs, starts)


def _heads(
    parts: Sequence[BlockPart], counts: Sequence[int], sizes: Times, logs: Times
) -> NDArray[np.void]:
    """Return what precedes each payload, shape (n,)."""
    heads = np.zeros(len(logs), dtype=MESSAGE_PREFIX)
    heads["opcode"] = Opcode.MESSAGE
    heads["length"] = sizes - HEAD.size
    heads["channel"] = np.repeat([part.channel for part in parts], counts)
    before = np.array([part.sequence for part in parts]) - np.cumsum(counts) + counts
    heads["sequence"] = (np.repeat(before, counts) + np.arange(len(logs))) & 0xFFFF_FFFF
    heads["log"] = heads["publish"] = logs
    return heads


def _sizes(parts: Sequence[BlockPart], counts: Sequence[int]) -> Times:
    """Return the length of each record, shape (n,)."""
    sizes = np.repeat([part.layout.size if part.layout else 0 for part in parts], counts)
    end = 0
    for part, count in zip(parts, counts, strict=True):
        end += count
        if part.layout is None:
            sizes[end - count : end] = [len(payload) for payload in part.batch.contents]
    return _PREFIX + sizes


def _row_data(heads: NDArray[np.void], parts: Sequence[BlockPart]) -> tuple[Bytes | Times, ...]:
    """Return the further arguments of `place_rows` for channels that carry rows.

    Raises:
        InputError: a row of another length, or a stamp that a ROS stamp cannot hold.
    """
    forms, runs, templates = _forms(tuple(part.layout for part in parts if part.layout))
    for part in parts:
        _check_length(part)
    counts = np.array([len(part.batch.logs) for part in parts])
    forms = np.column_stack([counts, forms])
    numbers = b"".join(chain.from_iterable(part.batch.contents for part in parts))
    as_bytes = heads.view(np.uint8), _stamps(parts).view(np.uint8)
    return *as_bytes, np.frombuffer(numbers, dtype=np.uint8), forms, runs, templates


@lru_cache(maxsize=64)
def _forms(layouts: tuple[Layout, ...]) -> tuple[Times, Times, Bytes]:
    """Return `forms` without their counts, `runs` and `templates` of `place_rows`."""
    runs = [(offset, 8 * count) for layout in layouts for offset, count in layout.runs]
    firsts = np.cumsum([0, *(len(layout.runs) for layout in layouts)]).tolist()
    forms = [
        (layout.size, layout.seconds, first, len(layout.runs))
        for layout, first in zip(layouts, firsts, strict=False)
    ]
    templates = [layout.template for layout in layouts]
    places = np.array(runs, dtype=np.int64).reshape(len(runs), 2)
    return np.array(forms, dtype=np.int64), places, np.concatenate(templates)


def _check_length(part: BlockPart) -> None:
    assert part.layout is not None
    width, count, stamps = part.layout.topic.width, len(part.batch.logs), len(part.batch.stamps)
    if stamps != count:
        raise InputError(f"{part.name}: {stamps} stamps of {count} messages, allowed: one of each")
    if sum(map(len, part.batch.contents)) != 8 * width * count:
        raise InputError(f"{part.name}: a row of another length, allowed: {width} float64")


def _stamps(parts: Sequence[BlockPart]) -> NDArray[np.void]:
    """Return seconds and nanoseconds of the parts' stamps, shape (n,).

    Raises:
        InputError: a stamp that a ROS stamp cannot hold.
    """
    stamps = _times(parts, [part.batch.stamps for part in parts])
    ends = np.cumsum([len(part.batch.stamps) for part in parts])
    names = [part.name for part in parts]
    seconds, nanoseconds = split_stamps(
        stamps, lambda i: names[int(np.searchsorted(ends, i, side="right"))]
    )
    found = np.empty(len(stamps), dtype=_STAMP)
    found["sec"], found["nanosec"] = seconds, nanoseconds
    return found


def _place_payloads(
    out: Bytes, starts: Times, heads: NDArray[np.void], parts: Sequence[BlockPart]
) -> None:
    """Write the records of channels whose payloads are given."""
    given = chain.from_iterable(part.batch.contents for part in parts if part.layout is None)
    for start, head, payload in zip(starts.tolist(), heads, given, strict=True):
        record = head.tobytes() + payload
        out[start : start + len(record)] = np.frombuffer(record, dtype=np.uint8)


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


def _log_times(parts: Sequence[BlockPart]) -> Times:
    logs = _times(parts, [part.batch.logs for part in parts])
    if logs.min() < 0:
        name, first = next((p.name, min(p.batch.logs)) for p in parts if min(p.batch.logs) < 0)
        raise InputError(f"{name}: log time {first} ns, allowed: 0 or later")
    return logs


def _times(parts: Sequence[BlockPart], times: Sequence[list[int]]) -> Times:
    """Return times of the parts [ns], one after another.

    Raises:
        InputError: one beyond what 64 bits hold.
    """
    try:
        return _joined(times)
    except OverflowError:
        most = 2**63 - 1
        name = next(
            part.name
            for part, own in zip(parts, times, strict=True)
            if not -most - 1 <= min(own) <= max(own) <= most
        )
        raise InputError(f"{name}: a time beyond ±{most} ns") from None


def _joined(lists: Iterable[list[int]]) -> Times:
    return np.array(list(chain.from_iterable(lists)), dtype=np.int64)


def _index(
    parts: Sequence[BlockPart], counts: Sequence[int], logs: Times, starts: Times
) -> dict[int, Index]:
    """Return each channel's log times and offsets by offset, hence by log time, by its id."""
    entries = np.stack([logs, starts], axis=1).astype("<u8")
    ends = np.cumsum(counts)
    rising = np.append(starts[1:] > starts[:-1], True)
    rising[ends - 1] = True
    index = {}
    for part, count, end in zip(parts, counts, ends.tolist(), strict=True):
        index[part.channel] = entries[end - count : end]
    if not rising.all():
        return {channel: own[np.argsort(own[:, 1])] for channel, own in index.items()}
    return index
