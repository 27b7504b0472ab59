"""A chunk being read: decompressed, checked, its messages found by array operations."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from numpy.typing import NDArray

from cspm_msgs_py.errors import DamageError
from cspm_msgs_py.recording.records import HEAD, MESSAGE_PREFIX, Opcode, Span, spans_in

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Prefixes = NDArray[np.void]

ChunkIndex = dict[int, NDArray[np.uint64]]
"""Log time [ns] and offset of each message, shape (n, 2), by channel id."""

LARGEST_CHUNK = 1 << 30
_PREFIX = MESSAGE_PREFIX.itemsize
_CHUNK_HEAD = struct.Struct("<QQQII")
_INDEX_HEAD = struct.Struct("<BQHI")
_INDEX_ENTRY = 16


class ChunkHead(NamedTuple):
    """What precedes the data of a Chunk record.

    Attributes:
        first_ns: earliest log time in it [ns].
        last_ns: latest log time in it [ns].
        size: uncompressed size [bytes].
        crc: CRC-32 of the uncompressed data, 0 for none.
        compression: `zstd`, `lz4` or empty.
        data: offset of the data in the record's content.
        data_size: compressed size [bytes].
    """

    first_ns: int
    last_ns: int
    size: int
    crc: int
    compression: str
    data: int
    data_size: int


class ChunkPlace(NamedTuple):
    """Where a chunk is: its record, and the Message Index records that follow it.

    A run of Message records outside any chunk is treated as a chunk without compression; for it
    `loose` is set and `record` covers the run.
    """

    record: Span
    index_end: int
    loose: bool = False


def chunk_head(content: bytes, length: int, where: str) -> ChunkHead:
    """Return a chunk's head.

    Args:
        content: the record's content, or at least its first bytes.
        length: length of the whole content.
        where: names the chunk in errors.

    Raises:
        DamageError: it does not fit the record.
    """
    try:
        first, last, size, crc, name_length = _CHUNK_HEAD.unpack_from(content)
        name_end = _CHUNK_HEAD.size + name_length
        name = content[_CHUNK_HEAD.size : name_end].decode()
        (data_size,) = struct.unpack_from("<Q", content, name_end)
    except (struct.error, UnicodeDecodeError):
        raise DamageError(f"{where}: damaged Chunk record") from None
    head = ChunkHead(first, last, size, crc, name, name_end + 8, data_size)
    if head.data + data_size > length:
        raise DamageError(f"{where}: damaged Chunk record")
    if size > LARGEST_CHUNK:
        raise DamageError(f"{where}: a chunk of {size} bytes, allowed: up to {LARGEST_CHUNK}")
    return head


def decompress(data: bytes, head: ChunkHead, where: str) -> bytes:
    """Return a chunk's content, its length and CRC checked.

    Raises:
        DamageError: the data is damaged or compressed in a way that is not known.
    """
    try:
        content = _DECOMPRESS[head.compression](data, head.size)
    except KeyError:
        raise DamageError(
            f"{where}: compression {head.compression!r}, allowed: zstd, lz4 or none"
        ) from None
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError) as err:
        raise DamageError(
            f"{where}: damaged {head.compression} data ({_first_line(err)})"
        ) from None
    if len(content) != head.size:
        raise DamageError(f"{where}: {len(content)} bytes where {head.size} are announced")
    if head.crc and zlib.crc32(content) != head.crc:
        raise DamageError(f"{where}: the chunk's CRC does not fit its content")
    return content


def _zstd(data: bytes, size: int) -> bytes:
    backend: Any = zstandard
    announced = backend.frame_content_size(data)
    if announced > size:
        raise ValueError(f"{announced} bytes announced, {size} expected")
    return bytes(backend.ZstdDecompressor().decompress(data, max_output_size=size))


def _lz4(data: bytes, size: int) -> bytes:
    announced = lz4.frame.get_frame_info(data)["content_size"]
    if announced > size:
        raise ValueError(f"{announced} bytes announced, {size} expected")
    decompressor = lz4.frame.LZ4FrameDecompressor()
    content: bytes = decompressor.decompress(data, max_length=size)
    return content


_DECOMPRESS: dict[str, Callable[[bytes, int], bytes]] = {
    "zstd": _zstd,
    "lz4": _lz4,
    "": lambda data, size: data,
}


def _first_line(err: BaseException) -> str:
    return (str(err).splitlines() or [type(err).__name__])[0]


class Messages:
    """The messages of one chunk, in the order in which they stand in it.

    Attributes:
        content: the chunk's content.
        offsets: offset of each Message record, shape (n,).
        prefixes: what precedes each payload, dtype `MESSAGE_PREFIX`, shape (n,).
    """

    def __init__(self, content: bytes, offsets: Integers, prefixes: Prefixes) -> None:
        """Keep the three."""
        self.content = content
        self.offsets = offsets
        self.prefixes = prefixes

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def channels(self) -> NDArray[np.uint16]:
        """Channel id of each message, shape (n,)."""
        return np.asarray(self.prefixes["channel"])

    @property
    def logs(self) -> Integers:
        """Log time of each message [ns], shape (n,)."""
        return self.prefixes["log"].astype(np.int64)

    @property
    def sizes(self) -> Integers:
        """Length of each payload [bytes], shape (n,)."""
        return self.prefixes["length"].astype(np.int64) - (_PREFIX - HEAD.size)

    def select(self, channels: Iterable[int]) -> Messages:
        """Return the messages of some channels."""
        chosen = np.zeros(len(self), dtype=bool)
        for channel in channels:
            chosen |= self.channels == channel
        return Messages(self.content, self.offsets[chosen], self.prefixes[chosen])

    def payloads(self) -> Iterator[bytes]:
        """Yield each message's payload."""
        starts = self.offsets + _PREFIX
        for start, size in zip(starts.tolist(), self.sizes.tolist(), strict=True):
            yield self.content[start : start + size]

    def payload_matrix(self) -> Bytes | None:
        """Return the payloads, shape (n, size), or None if their lengths differ."""
        sizes = self.sizes
        if not len(sizes) or (sizes != sizes[0]).any():
            return None
        windows = _windows(self.content, int(sizes[0]))
        payloads: Bytes = windows[self.offsets + _PREFIX]
        return payloads

    def index(self) -> ChunkIndex:
        """Return log time and offset of each message, shape (n, 2), by channel id."""
        entries = np.stack([self.prefixes["log"], self.offsets.astype(np.uint64)], axis=1)
        return {int(c): entries[self.channels == c] for c in np.unique(self.channels)}


def read_messages(content: bytes, index: ChunkIndex | None, where: str) -> Messages:
    """Return the messages of a chunk.

    Args:
        content: the chunk's content.
        index: what the Message Index records after the chunk say, None without any. They are
            believed only where they agree with the content and account for all of it.
        where: names the chunk in errors.

    Raises:
        DamageError: the content is not a sequence of records.
    """
    return (_by_index(content, index) if index else None) or scan_messages(content, where)


def scan_messages(content: bytes, where: str) -> Messages:
    """Return the messages of a chunk by walking from record to record.

    Raises:
        DamageError: the content is not a sequence of records.
    """
    found, end = [], 0
    for span in spans_in(content):
        if span.opcode == Opcode.MESSAGE:
            if span.length < _PREFIX - HEAD.size:
                raise DamageError(f"{where}: damaged Message record at {span.offset}")
            found.append(span.offset)
        end = span.end
    if end != len(content):
        raise DamageError(f"{where}: no record at byte {end} of the chunk")
    offsets = np.array(found, dtype=np.int64)
    return Messages(content, offsets, _prefixes(content, offsets))


def other_records(content: bytes) -> Iterator[Span]:
    """Yield the records of a chunk that are not messages."""
    return (span for span in spans_in(content) if span.opcode != Opcode.MESSAGE)


def read_index(records: bytes) -> ChunkIndex | None:
    """Return what the Message Index records after a chunk say, None if they are none."""
    index: ChunkIndex = {}
    end = 0
    while end + _INDEX_HEAD.size <= len(records):
        opcode, length, channel, size = _INDEX_HEAD.unpack_from(records, end)
        start, end = end + _INDEX_HEAD.size, end + HEAD.size + length
        fits = size == end - start and size % _INDEX_ENTRY == 0 and end <= len(records)
        if opcode != Opcode.MESSAGE_INDEX or not fits or channel in index:
            return None
        index[channel] = np.frombuffer(records, "<u8", size // 8, start).reshape(-1, 2)
    return index if index and end == len(records) else None


def _by_index(content: bytes, index: ChunkIndex) -> Messages | None:
    table = np.concatenate(list(index.values()))
    if not len(table) or table[:, 1].max() > max(len(content) - _PREFIX, 0):
        return None
    channels = np.repeat(list(index), [len(entries) for entries in index.values()])
    order = np.argsort(table[:, 1])
    offsets = table[order, 1].astype(np.int64)
    prefixes = _prefixes(content, offsets)
    lengths = prefixes["length"].astype(np.int64)
    ends = np.append(offsets[1:], len(content))
    agrees = (
        offsets[0] == 0
        and (prefixes["opcode"] == Opcode.MESSAGE).all()
        and (prefixes["channel"] == channels[order]).all()
        and (prefixes["log"] == table[order, 0]).all()
        and (lengths >= _PREFIX - HEAD.size).all()
        and (offsets + HEAD.size + lengths == ends).all()
    )
    return Messages(content, offsets, prefixes) if agrees else None


def _prefixes(content: bytes, offsets: Integers) -> Prefixes:
    if not len(offsets):
        return np.zeros(0, dtype=MESSAGE_PREFIX)
    heads: Bytes = _windows(content, _PREFIX)[offsets]
    return heads.view(MESSAGE_PREFIX)[:, 0]


def _windows(content: bytes, size: int) -> Bytes:
    """Return a view whose row i is the `size` bytes from offset i on."""
    shape = (max(len(content) - size + 1, 0), size)
    windows: Bytes = np.ndarray(shape, np.uint8, content, strides=(1, 1))
    return windows
