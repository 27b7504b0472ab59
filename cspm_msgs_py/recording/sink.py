"""An MCAP file being written: records out, index and statistics kept, summary at the end."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from tempfile import SpooledTemporaryFile

import numpy as np
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from cspm_msgs_py.recording.records import HEAD, MAGIC, Opcode, pack

Index = NDArray[np.uint64]
_INDEX_IN_MEMORY = 1 << 16
_COPY = 1 << 16
_INDEX_HEAD = struct.Struct("<BQHI")


class McapSink:
    """Writes one new MCAP file; memory does not grow with its length.

    Nothing is buffered: what a method was given is with the operating system when it returns, so
    that a process killed later leaves it in the file.
    """

    def __init__(self, path: Path, header: Header) -> None:
        """Create the file, which must not exist.

        Raises:
            OSError: it exists or cannot be written.
        """
        self._file = path.open("xb", buffering=0)
        self._chunk_indexes = SpooledTemporaryFile(  # noqa: SIM115 - lives as long as the file
            max_size=_INDEX_IN_MEMORY, dir=str(path.parent)
        )
        self._offset = 0
        self._crc = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._chunks = 0
        self._first, self._last = 2**64 - 1, 0
        self.counts: Counter[int] = Counter()
        self._write(MAGIC + pack(header))

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last log time of what has been written [ns]; zeros for no message."""
        return (self._first, self._last) if self._chunks else (0, 0)

    def _write(self, content: bytes) -> None:
        self._crc = zlib.crc32(content, self._crc)
        rest = memoryview(content)
        while rest:
            rest = rest[self._file.write(rest) :]
        self._offset += len(content)

    def add_schema(self, schema: Schema) -> None:
        """Write a schema, once per id."""
        if self._schemas.setdefault(schema.id, schema) is schema:
            self._write(pack(schema))

    def add_channel(self, channel: Channel) -> None:
        """Write a channel, once per id; its schema comes before."""
        if self._channels.setdefault(channel.id, channel) is channel:
            self._write(pack(channel))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment."""
        content = pack(attachment)
        self._attachments.append(
            AttachmentIndex(
                offset=self._offset,
                length=len(content),
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )
        self._write(content)

    def add_metadata(self, metadata: Metadata) -> None:
        """Write a metadata record."""
        content = pack(metadata)
        self._metadata.append(
            MetadataIndex(offset=self._offset, length=len(content), name=metadata.name)
        )
        self._write(content)

    def add_chunk(self, chunk: Chunk, index: Mapping[int, Index]) -> None:
        """Write a chunk and its message indexes in one go.

        Args:
            chunk: the chunk.
            index: log time [ns] and offset of each message, shape (n, 2), by channel id.
        """
        content = pack(chunk)
        pieces, offsets, end = [content], {}, self._offset + len(content)
        for channel, entries in index.items():
            piece = _pack_index(channel, entries)
            offsets[channel] = end
            pieces.append(piece)
            end += len(piece)
            self.counts[channel] += len(entries)
        self._chunk_indexes.write(
            pack(
                ChunkIndex(
                    chunk_length=len(content),
                    chunk_start_offset=self._offset,
                    compression=chunk.compression,
                    compressed_size=len(chunk.data),
                    message_end_time=chunk.message_end_time,
                    message_index_length=end - self._offset - len(content),
                    message_index_offsets=offsets,
                    message_start_time=chunk.message_start_time,
                    uncompressed_size=chunk.uncompressed_size,
                )
            )
        )
        self._write(b"".join(pieces))
        self._chunks += 1
        self._first = min(self._first, chunk.message_start_time)
        self._last = max(self._last, chunk.message_end_time)

    def finish(self) -> None:
        """Write the summary section and the footer, and close the file."""
        self._write(pack(DataEnd(self._crc)))
        summary_start, self._crc = self._offset, 0
        offsets = [offset for code, group in self._groups() for offset in self._group(code, group)]
        offset_start = self._offset
        self._write(pack(*offsets))
        footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", summary_start, offset_start)
        crc = zlib.crc32(footer, self._crc)
        self._write(footer + struct.pack("<I", crc) + MAGIC)
        self.close()

    def close(self) -> None:
        """Close the file as it is, for an end without summary."""
        self._file.close()
        self._chunk_indexes.close()

    def _groups(self) -> Iterator[tuple[Opcode, Iterable[bytes]]]:
        self._chunk_indexes.seek(0)
        yield Opcode.SCHEMA, [pack(*self._schemas.values())]
        yield Opcode.CHANNEL, [pack(*self._channels.values())]
        yield Opcode.STATISTICS, [pack(self._statistics())]
        yield Opcode.CHUNK_INDEX, iter(lambda: self._chunk_indexes.read(_COPY), b"")
        yield Opcode.ATTACHMENT_INDEX, [pack(*self._attachments)]
        yield Opcode.METADATA_INDEX, [pack(*self._metadata)]

    def _group(self, code: Opcode, pieces: Iterable[bytes]) -> list[SummaryOffset]:
        start = self._offset
        for piece in pieces:
            self._write(piece)
        length = self._offset - start
        return [SummaryOffset(code, start, length)] if length else []

    def _statistics(self) -> Statistics:
        first, last = self.span_ns
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self.counts.items())),
            chunk_count=self._chunks,
            message_count=self.counts.total(),
            message_end_time=last,
            message_start_time=first,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _pack_index(channel: int, entries: Index) -> bytes:
    size = 16 * len(entries)
    return _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size) + entries.tobytes()
