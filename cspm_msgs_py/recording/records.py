"""Records of an MCAP file, as bytes and back.

Format: https://mcap.dev/spec. A record is an opcode (1 byte), the length of its content (8 bytes,
little endian) and the content; a file is a magic, records, and the magic again.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, McapRecord, Schema

from cspm_msgs_py.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
ROS1_MAGIC = b"#ROSBAG V"
HEAD = struct.Struct("<BQ")

MESSAGE_PREFIX = np.dtype(
    {
        "names": ["opcode", "length", "channel", "sequence", "log", "publish"],
        "formats": ["u1", "<u8", "<u2", "<u4", "<u8", "<u8"],
        "offsets": [0, 1, 9, 11, 15, 23],
        "itemsize": 31,
    }
)
"""What precedes the payload of a Message record."""

Record = TypeVar("Record", bound=McapRecord)


class Span(NamedTuple):
    """Place of one record in a file or chunk: offset of its opcode, length of its content."""

    opcode: int
    offset: int
    length: int

    @classmethod
    def whole(cls, opcode: int, offset: int, length: int) -> Span:
        """Return the place of a record of which the length with opcode and length is known."""
        return cls(opcode, offset, length - HEAD.size)

    @property
    def content(self) -> int:
        """Offset of the content."""
        return self.offset + HEAD.size

    @property
    def end(self) -> int:
        """Offset of the first byte after the record."""
        return self.offset + HEAD.size + self.length


def pack(*records: McapRecord) -> bytes:
    """Return records as the bytes of a file."""
    builder: Any = RecordBuilder()  # its methods are not all annotated
    for record in records:
        record.write(builder)
    return bytes(builder.end())


def parse(kind: type[Record], content: bytes, where: str) -> Record:
    """Return a record from its content; `where` names it in errors.

    Raises:
        InputError: the content is not such a record.
    """
    reader: Any = kind.read  # type: ignore[attr-defined]
    try:
        record: Record = reader(ReadDataStream(BytesIO(content)))
    except (McapError, struct.error, ValueError, MemoryError, OverflowError):
        raise InputError(f"{where}: damaged {kind.__name__} record") from None
    held = record.data if isinstance(record, Schema | Attachment) else b""
    if len(held) > len(content):
        raise InputError(f"{where}: damaged {kind.__name__} record")
    return record


def parse_attachment(content: bytes, where: str) -> Attachment:
    """Return an attachment after checking its CRC.

    Raises:
        InputError: the content is not an attachment or its CRC does not fit.
    """
    attachment = parse(Attachment, content, where)
    crc = int.from_bytes(content[-4:], "little")
    if crc and crc != zlib.crc32(content[:-4]):
        raise InputError(f"{where}: attachment {attachment.name!r} is damaged (CRC)")
    return attachment


def starts_with(path: Path, *magics: bytes) -> bool:
    """Return whether a file begins with one of some byte strings.

    Raises:
        InputError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return file.read(max(map(len, magics))).startswith(magics)
    except OSError as err:
        raise InputError(f"{path}: {err.strerror}") from None


def read_at(file: IO[bytes], offset: int, length: int, path: Path) -> bytes:
    """Return `length` bytes of a file.

    Raises:
        InputError: the file ends before or cannot be read.
    """
    try:
        file.seek(offset)
        content = file.read(length)
    except (OSError, OverflowError, ValueError, MemoryError) as err:
        raise InputError(f"{path}: not readable at byte {offset} ({err})") from None
    if len(content) != length:
        raise InputError(f"{path}: ends inside the record at byte {offset}")
    return content


def spans(file: IO[bytes], start: int, stop: int) -> Iterator[Span]:
    """Yield the records between two offsets, up to the first that is not complete."""
    offset = start
    while offset + HEAD.size <= stop:
        file.seek(offset)
        head = file.read(HEAD.size)
        if len(head) < HEAD.size:
            return
        opcode, length = HEAD.unpack(head)
        span = Span(opcode, offset, length)
        if opcode == 0 or span.end > stop:
            return
        yield span
        offset = span.end


def spans_in(content: bytes) -> Iterator[Span]:
    """Yield the records that `content` holds, up to the first that is not complete."""
    offset = 0
    while offset + HEAD.size <= len(content):
        opcode, length = HEAD.unpack_from(content, offset)
        span = Span(opcode, offset, length)
        if opcode == 0 or span.end > len(content):
            return
        yield span
        offset = span.end


__all__ = [
    "HEAD",
    "MAGIC",
    "MESSAGE_PREFIX",
    "Opcode",
    "Span",
    "pack",
    "parse",
    "parse_attachment",
    "read_at",
    "spans",
    "spans_in",
]
