"""Restoring a ROS 1 bag: its whole chunks as they are, and an index of them.

Format: https://wiki.ros.org/Bags/Format/2.0; see `ros1_runs`.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from contextlib import closing
from pathlib import Path
from typing import IO

from cspm_msgs_py.bag.ros1_runs import (
    BAG,
    CHUNK,
    CHUNK_INFO,
    CONNECTION,
    INDEX,
    MESSAGE,
    VERSION,
    ChunkInfo,
    Ros1Runs,
    records,
)
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.message import NANOSECONDS
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.recording.records import ROS1_MAGIC as MAGIC
from cspm_msgs_py.recording.recover import BROKEN_SUFFIX, RecoveryReport, exchange

_HEAD_BYTES = 4096
_INDEX_VERSION = struct.pack("<I", 1)


def recover_ros1(path: Path, out: Path | None) -> RecoveryReport:
    """Restore a ROS 1 bag as `recover` does, in place or in a new folder.

    Raises:
        InputError: no ROS 1 bag, or without a whole chunk; or a file is in the way.
        CspmError: the restored file cannot be written.
    """
    broken, target = Path(f"{path}{BROKEN_SUFFIX}"), Path(f"{path}.restoring")
    with closing(_opened(path)) as source:
        chunks = [info for info in source.chunks if _is_whole(source, info)]
        damaged = len(source.chunks) - len(chunks)
        changed = out is not None or bool(damaged or source.faults)
        if changed and out is None and broken.exists():
            raise InputError(f"{broken}: already exists, allowed: move it away first")
        try:
            if out is not None:
                refuse_existing(out)
                out.mkdir(parents=True)
                target = out / path.name
            if changed:
                _write(source, chunks, target)
            if changed and out is None:
                exchange(path, target, broken)
        except OSError as err:
            raise CspmError(f"{path}: cannot be restored ({err.strerror})") from None
        return RecoveryReport(
            path=out or path,
            restored=[target if out else path] if changed else [],
            kept=[path if out else broken] if changed else [],
            counts=_counts(source, chunks),
            end_ns=max((info.last_ns for info in chunks), default=0),
            damaged=damaged,
            lost_bytes=source.lost_bytes,
            bare=[],
            described=False,
            left_out=[],
        )


def _opened(path: Path) -> Ros1Runs:
    try:
        return Ros1Runs(path)
    except InputError:
        return Ros1Runs(path, indexed=False)


def _counts(source: Ros1Runs, chunks: list[ChunkInfo]) -> dict[str, int]:
    """Return the number of messages by topic."""
    topics = {channel.id: channel.topic for channel in source.channels}
    counts = dict.fromkeys(topics.values(), 0)
    for info in chunks:
        for channel, count in info.counts.items():
            counts[topics[channel]] += count
    return counts


def _is_whole(source: Ros1Runs, info: ChunkInfo) -> bool:
    try:
        source.messages_of(info)
    except InputError:
        return False
    return True


def _write(source: Ros1Runs, chunks: list[ChunkInfo], target: Path) -> None:
    placed = []
    try:
        with target.open("xb") as file:
            file.write(MAGIC + VERSION + _bag_head(0, 0, 0))
            for info in chunks:
                placed.append(info._replace(place=file.tell()))
                _write_chunk(file, source, info)
            index = file.tell()
            file.writelines(_connection(about) for about in source.connections.values())
            file.writelines(_chunk_info(info) for info in placed)
            file.seek(len(MAGIC + VERSION))
            file.write(_bag_head(index, len(source.connections), len(placed)))
    except BaseException:
        target.unlink(missing_ok=True)
        raise


def _write_chunk(file: IO[bytes], source: Ros1Runs, info: ChunkInfo) -> None:
    """Write a chunk and its index."""
    chunk = source.chunk(info.place)
    size = struct.pack("<I", len(chunk.content))
    file.write(_record(chunk.data, op=CHUNK, compression=chunk.compression, size=size))
    entries: dict[bytes, list[bytes]] = defaultdict(list)
    begin = 0
    for fields, _, end in records(chunk.content):
        if fields[b"op"] == MESSAGE:
            entries[fields[b"conn"]].append(fields[b"time"] + struct.pack("<I", begin))
        begin = end
    for number, found in entries.items():
        count = struct.pack("<I", len(found))
        head = {"op": INDEX, "ver": _INDEX_VERSION, "conn": number, "count": count}
        file.write(_record(b"".join(found), **head))


def _connection(about: dict[bytes, bytes]) -> bytes:
    fields = {name.decode(): value for name, value in about.items()}
    head = {"op": CONNECTION, "conn": fields.pop("conn"), "topic": fields["topic"]}
    fields.pop("op")
    return _record(_header(fields), **head)


def _chunk_info(info: ChunkInfo) -> bytes:
    return _record(
        b"".join(struct.pack("<II", *each) for each in info.counts.items()),
        op=CHUNK_INFO,
        ver=_INDEX_VERSION,
        chunk_pos=struct.pack("<Q", info.place),
        start_time=_time(info.first_ns),
        end_time=_time(info.last_ns),
        count=struct.pack("<I", len(info.counts)),
    )


def _bag_head(index: int, connection_count: int, chunk_count: int) -> bytes:
    """Return the first record, whose length is always the same."""
    fields = {
        "op": BAG,
        "index_pos": struct.pack("<Q", index),
        "conn_count": struct.pack("<I", connection_count),
        "chunk_count": struct.pack("<I", chunk_count),
    }
    return _record(b" " * (_HEAD_BYTES - len(_record(b"", **fields))), **fields)


def _record(data: bytes, **fields: bytes) -> bytes:
    header = _header(fields)
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def _header(fields: dict[str, bytes]) -> bytes:
    return b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
        for name, value in fields.items()
    )


def _time(log_ns: int) -> bytes:
    return struct.pack("<II", *divmod(log_ns, NANOSECONDS))
