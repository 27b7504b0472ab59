"""A ROS 1 bag as runs of messages, one for each chunk.

Format: https://wiki.ros.org/Bags/Format/2.0. A record is the length of its header, the header, the
length of its data and the data; a header is fields, each its length and `name=value`; numbers are
little endian, a time is seconds and nanoseconds, unsigned 32 bit each. The reader of `rosbags`
holds an entry for each message in memory and orders those of one log time by connection, which is
why the chunks are read here.
"""

from __future__ import annotations

import bz2
import struct
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]

from cspm_msgs_py.bag.run import StoredChannel, StoredMessage, StoredRun
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS
from cspm_msgs_py.recording.chunk import LARGEST_CHUNK
from cspm_msgs_py.recording.records import ROS1_MAGIC as MAGIC
from cspm_msgs_py.recording.records import read_at
from cspm_msgs_py.ros_types import ROS1_SCHEMA_ENCODING

ENCODING = "ros1"
VERSION = b"2.0\n"
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = (bytes([op]) for op in range(2, 8))
_LARGEST_HEADER = 1 << 20
_UINT32 = struct.Struct("<I")
_UINT64 = struct.Struct("<Q")
_TWO = struct.Struct("<II")

_Fields = dict[bytes, bytes]


class _Chunk(NamedTuple):
    """A chunk: its compression, its data as they stand in the file, and what they unpack to."""

    compression: bytes
    data: bytes
    content: bytes


class _Record(NamedTuple):
    """A record: its header's fields, offset and length of its data."""

    fields: _Fields
    data: int
    length: int

    @property
    def end(self) -> int:
        return self.data + self.length


class ChunkInfo(NamedTuple):
    """What the index says about a chunk: its place, log times [ns], and messages by channel."""

    place: int
    first_ns: int
    last_ns: int
    counts: dict[int, int]


class Ros1Runs:
    """A ROS 1 bag of format 2.0; see `StoredFile`.

    Attributes:
        chunks: what the index says about each chunk, or what was found without one.
        connections: fields of each connection by its number.
        lost_bytes: what follows the last whole chunk of a bag without index [bytes].
    """

    def __init__(self, path: Path, *, indexed: bool = True) -> None:
        """Open the bag and read its index, or with `indexed` False all of it.

        Raises:
            InputError: it is not such a bag, or is damaged.
        """
        self.path = path
        self.faults: list[str] = []
        self.lost_bytes = 0
        self.connections: dict[int, _Fields] = {}
        self._file = path.open("rb")
        try:
            with self._damage("index"):
                self.chunks = self._read_index(indexed=indexed)
        except BaseException:
            self._file.close()
            raise
        self.runs = [
            StoredRun(info.first_ns, info.last_ns, partial(self._read, info))
            for info in sorted(self.chunks, key=itemgetter(0))
            if sum(info.counts.values())
        ]

    @contextmanager
    def _damage(self, what: str) -> Iterator[None]:
        """Turn what reading damaged bytes raises into one line."""
        try:
            yield
        except (struct.error, KeyError, ValueError) as err:
            raise InputError(f"{self.path}: damaged {what} ({_reason(err)})") from None

    def _read_index(self, *, indexed: bool) -> list[ChunkInfo]:
        """Return the chunks; set `channels`."""
        if self._bytes(len(MAGIC), len(VERSION)) != VERSION:
            raise InputError(f"{self.path}: a ROS 1 bag of another format, allowed: V2.0")
        first = self._record(len(MAGIC) + len(VERSION), BAG)
        head = first.fields
        if head.get(b"encryptor"):
            raise InputError(f"{self.path}: an encrypted bag, allowed: one that is not")
        (end,) = _UINT64.unpack(head[b"index_pos"])
        if end == 0 or not indexed:
            return self._scan(first.end, "was not closed" if indexed else "has a damaged index")
        try:
            return self._indexed(head, end)
        except InputError:
            return self._scan(first.end, "ends inside its index")

    def _indexed(self, head: _Fields, end: int) -> list[ChunkInfo]:
        infos = []
        for _ in range(_uint32(head[b"conn_count"])):
            record = self._record(end, CONNECTION)
            about = _fields(self._bytes(record.data, record.length))
            self.connections[_uint32(record.fields[b"conn"])] = record.fields | about
            end = record.end
        for _ in range(_uint32(head[b"chunk_count"])):
            record = self._record(end, CHUNK_INFO)
            infos.append(_chunk_info(record.fields, self._bytes(record.data, record.length)))
            end = record.end
        counts: Counter[int] = Counter()
        for info in infos:
            counts.update(info.counts)
        self.channels = [_described(*each, counts) for each in self.connections.items()]
        unknown = counts.keys() - self.connections.keys()
        if unknown:
            raise ValueError(f"messages on connection {min(unknown)}, which no record describes")
        return infos

    def _scan(self, place: int, why: str) -> list[ChunkInfo]:
        """Return the whole chunks of a bag without index, from a place on; set `channels`."""
        size = self.path.stat().st_size
        infos: list[ChunkInfo] = []
        counts: Counter[int] = Counter()
        while place < size:
            try:
                record = self._any_record(place)
                if record.fields[b"op"] == CHUNK:
                    content = self.chunk(place).content
                    times = [(log, channel) for log, channel, _ in messages(content)]
                    found = dict(_connections(content))
                elif record.end > size:
                    break
                else:
                    place = record.end
                    continue
            except (struct.error, KeyError, ValueError, InputError):
                break
            self.connections |= found
            here = Counter(channel for _, channel in times)
            if times and here.keys() <= self.connections.keys():
                infos.append(ChunkInfo(place, min(times)[0], max(times)[0], dict(here)))
                counts += here
            is_open = not record.length or record.end > size
            place = record.data + len(content) if is_open else record.end
        if not infos:
            raise InputError(
                f"{self.path}: a ROS 1 bag that {why}, and holds no whole chunk, allowed: at least"
                " one"
            )
        self.lost_bytes = size - place
        self.channels = [_described(*each, counts) for each in self.connections.items()]
        self.faults.append(
            f"{self.path}: a ROS 1 bag that {why}: {len(infos)} chunks with"
            f" {counts.total()} messages are read, {self.lost_bytes} bytes after them left out"
        )
        return infos

    def _bytes(self, offset: int, length: int) -> bytes:
        return read_at(self._file, offset, length, self.path)

    def _record(self, offset: int, opcode: bytes) -> _Record:
        """Return the record at an offset of the file.

        Raises:
            ValueError: it is not one of the kind `opcode`.
        """
        record = self._any_record(offset)
        if record.fields.get(b"op") != opcode:
            raise ValueError(f"no record of kind {opcode[0]} at byte {offset}")
        return record

    def _any_record(self, offset: int) -> _Record:
        length = _uint32(self._bytes(offset, 4))
        if length > _LARGEST_HEADER:
            raise ValueError(f"no record at byte {offset}")
        header = self._bytes(offset + 4, length + 4)
        return _Record(_fields(header[:-4]), offset + 8 + length, _uint32(header[-4:]))

    def _read(
        self, info: ChunkInfo, channels: Collection[int], start_ns: int
    ) -> Iterator[StoredMessage]:
        if info.counts.keys().isdisjoint(channels):
            return
        wanted = frozenset(channels)
        found = sorted(self.messages_of(info), key=itemgetter(0))
        yield from (m for m in found if m[0] >= start_ns and m[1] in wanted)

    def messages_of(self, info: ChunkInfo) -> list[StoredMessage]:
        """Return a chunk's messages as they stand in it.

        Raises:
            InputError: it is damaged, or holds others than `info` says.
        """
        with self._damage(f"chunk at byte {info.place}"):
            found = list(messages(self.chunk(info.place).content))
        times = [log for log, _, _ in found]
        if len(times) != sum(info.counts.values()) or (
            times and not info.first_ns <= min(times) <= max(times) <= info.last_ns
        ):
            raise InputError(
                f"{self.path}: chunk at byte {info.place}: other messages than its index says"
            )
        return found

    def chunk(self, place: int) -> _Chunk:
        """Return the chunk at an offset of the file.

        Raises:
            ValueError, struct.error, KeyError: it is damaged.
            InputError: the file ends before.
        """
        record = self._record(place, CHUNK)
        packed = record.fields[b"compression"]
        size, compression = _uint32(record.fields[b"size"]), packed.decode()
        if compression not in _DECOMPRESS:
            raise ValueError(f"compression {compression!r}, allowed: {', '.join(_DECOMPRESS)}")
        if size > LARGEST_CHUNK:
            raise ValueError(f"{size} bytes, allowed: up to {LARGEST_CHUNK}")
        rest = min(self.path.stat().st_size - record.data, LARGEST_CHUNK)
        if compression == "none" and (not record.length or record.length > rest):
            # A writer fills in the lengths when it ends the chunk: this one it never ended, or the
            # file is cut in it.
            content = _whole_part(self._bytes(record.data, rest))
            return _Chunk(packed, content, content)
        data = self._bytes(record.data, record.length)
        try:
            content = _DECOMPRESS[compression](data, size)
        except (OSError, EOFError, RuntimeError) as err:
            raise ValueError(f"no {compression} data: {_reason(err)}") from None
        if len(content) != size:
            raise ValueError(f"{len(content)} bytes where {size} are announced")
        return _Chunk(packed, data, content)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _bz2(data: bytes, size: int) -> bytes:
    return bz2.BZ2Decompressor().decompress(data, max_length=size)


def _lz4(data: bytes, size: int) -> bytes:
    content: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)
    return content


_DECOMPRESS: dict[str, Callable[[bytes, int], bytes]] = {
    "none": lambda data, size: data,
    "bz2": _bz2,
    "lz4": _lz4,
}


def _reason(err: BaseException) -> str:
    if isinstance(err, KeyError):
        return f"no field {err.args[0].decode()}"
    if isinstance(err, struct.error):
        return "a number cut short"
    return " ".join(str(err).split()) or type(err).__name__


def _uint32(value: bytes) -> int:
    (number,) = _UINT32.unpack(value)
    return int(number)


def _time_ns(value: bytes) -> int:
    seconds, nanoseconds = _TWO.unpack(value)
    return int(seconds) * NANOSECONDS + int(nanoseconds)


def _fields(header: bytes) -> _Fields:
    """Return a header's fields.

    Raises:
        ValueError: it does not consist of fields.
    """
    fields, offset = {}, 0
    while offset < len(header):
        (length,) = _UINT32.unpack_from(header, offset)
        end = offset + 4 + length
        name, equals, value = header[offset + 4 : end].partition(b"=")
        if not equals or end > len(header):
            raise ValueError("a header field without name or cut short")
        fields[name] = value
        offset = end
    return fields


def _chunk_info(fields: _Fields, data: bytes) -> ChunkInfo:
    (place,) = _UINT64.unpack(fields[b"chunk_pos"])
    first, last = _time_ns(fields[b"start_time"]), _time_ns(fields[b"end_time"])
    return ChunkInfo(place, first, last, dict(_TWO.iter_unpack(data)))


def _described(id_: int, about: _Fields, counts: Counter[int]) -> StoredChannel:
    return StoredChannel(
        id=id_,
        topic=about[b"topic"].decode(),
        ros_type=about[b"type"].decode(),
        count=counts[id_],
        encoding=ENCODING,
        schema_encoding=ROS1_SCHEMA_ENCODING,
        definition=about[b"message_definition"].decode(errors="replace"),
    )


def messages(content: bytes) -> Iterator[StoredMessage]:
    """Yield the messages of a chunk's content as they stand in it."""
    for fields, data, _ in records(content):
        if fields[b"op"] == MESSAGE:
            yield _time_ns(fields[b"time"]), _uint32(fields[b"conn"]), data


def _connections(content: bytes) -> Iterator[tuple[int, _Fields]]:
    """Yield number and description of the connections in a chunk's content."""
    for fields, data, _ in records(content):
        if fields[b"op"] == CONNECTION:
            # The topic that the header names is the one that counts.
            yield _uint32(fields[b"conn"]), {**fields, **_fields(data), b"topic": fields[b"topic"]}


def _whole_part(content: bytes) -> bytes:
    """Return the messages and connections with which a chunk's content begins."""
    whole = 0
    with suppress(struct.error, KeyError, ValueError):
        for fields, _, end in records(content):
            if fields[b"op"] not in (MESSAGE, CONNECTION):
                break
            whole = end
    return content[:whole]


def records(content: bytes) -> Iterator[tuple[_Fields, bytes, int]]:
    """Yield header and data of a chunk's records, and where each ends.

    Raises:
        ValueError, struct.error, KeyError: it is not a sequence of records.
    """
    offset = 0
    while offset < len(content):
        (length,) = _UINT32.unpack_from(content, offset)
        data = offset + 8 + length
        (size,) = _UINT32.unpack_from(content, data - 4)
        end = data + size
        if end > len(content):
            raise ValueError(f"a record of it ends {end - len(content)} bytes behind its end")
        yield _fields(content[offset + 4 : data - 4]), content[data:end], end
        offset = end
