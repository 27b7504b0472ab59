"""One MCAP file being read, with or without its index; it need not be complete."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.records import ChunkIndex as ChunkIndexRecord

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.chunk import (
    ChunkHead,
    ChunkIndex,
    ChunkPlace,
    Messages,
    chunk_head,
    decompress,
    other_records,
    read_index,
    read_messages,
)
from cspm_msgs_py.recording.closing import Closing
from cspm_msgs_py.recording.log_time import LATEST_NS, in_time, index_in_time, left_out
from cspm_msgs_py.recording.records import (
    HEAD,
    MAGIC,
    Opcode,
    Span,
    parse,
    parse_attachment,
    read_at,
    spans,
    spans_in,
)

# In a channel's metadata: messages that nobody of the recorded run obeyed; and before its topic.
REFUSED = "cspm_refused"
REFUSED_ROOT = "/refused"
_FOOTER_SIZE = HEAD.size + 20 + len(MAGIC)
_HEAD_SIZE = 256
_RUN = 1 << 22


class BareFileError(InputError):
    """A file that its writer left without a channel and a message."""


class McapFile(Closing):
    """The content of one MCAP file.

    A file that was closed is read by its summary, any other by walking over its records: all
    records that are complete are there.

    Attributes:
        path: the file.
        profile: such as `ros2`.
        library: what wrote it.
        complete: whether the file was closed, with a footer.
        end: offset after the last complete record, the file's length if no data is missing.
        schemas: by id.
        channels: by id.
        chunks: in file order.
        attachments: places of the attachments.
        metadata: places of the metadata records.
        statistics: the writer's own counts, None where it left none.
    """

    def __init__(self, path: Path, *, use_summary: bool = True) -> None:
        """Open a file and find its records.

        Args:
            path: the file.
            use_summary: False treats a closed file as one that was not: its summary is not read.

        Raises:
            InputError: it is missing, not an MCAP file, or its summary is damaged.
        """
        self.path = path
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkPlace] = []
        self.statistics: Statistics | None = None
        self.attachments: list[Span] = []
        self.metadata: list[Span] = []
        try:
            self._file = path.open("rb")
            self._size = self._file.seek(0, 2)
        except OSError as err:
            raise InputError(f"{path}: {_reason(err)}") from None
        try:
            self._read(use_summary)
        except BaseException:
            self._file.close()
            raise

    def _read(self, use_summary: bool) -> None:
        if self._size == 0:
            raise BareFileError(f"{self.path}: an empty file, allowed: an MCAP file")
        self._file.seek(0)
        if self._file.read(len(MAGIC)) != MAGIC:
            raise InputError(f"{self.path}: not an MCAP file (its first bytes are no MCAP magic)")
        first = next(spans(self._file, len(MAGIC), self._size), None)
        if first is None or first.opcode != Opcode.HEADER:
            raise BareFileError(f"{self.path}: an MCAP file that ends before its header does")
        header = parse(Header, self._content(first), str(self.path))
        self.profile, self.library = header.profile, header.library
        footer = self._footer() if use_summary else None
        self.complete = footer is not None
        self.end = self._size
        if footer is None or not self._read_summary(footer):
            self._scan(first.end)

    def _content(self, span: Span) -> bytes:
        return read_at(self._file, span.content, span.length, self.path)

    def _footer(self) -> Footer | None:
        if self._size < len(MAGIC) + _FOOTER_SIZE:
            return None
        tail = read_at(self._file, self._size - _FOOTER_SIZE, _FOOTER_SIZE, self.path)
        if not tail.endswith(MAGIC) or HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
            return None
        return parse(Footer, tail[HEAD.size : -len(MAGIC)], str(self.path))

    def _read_summary(self, footer: Footer) -> bool:
        """Take all from the summary; return whether it lists where the messages are."""
        start, end = footer.summary_start, self._size - _FOOTER_SIZE
        if start == 0:
            return False
        if not len(MAGIC) <= start <= end:
            raise InputError(f"{self.path}: the footer points outside the file")
        summary = read_at(self._file, start, end - start, self.path)
        head = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", start, footer.summary_offset_start)
        if footer.summary_crc and zlib.crc32(summary + head) != footer.summary_crc:
            raise InputError(f"{self.path}: the summary's CRC does not fit")
        for span in spans_in(summary):
            self._take_summary(span, summary[span.content : span.end])
        self.chunks.sort(key=lambda place: place.record.offset)
        return self._summary_suffices()

    def _take_summary(self, span: Span, content: bytes) -> None:
        kind = _SUMMARY_KINDS.get(span.opcode)
        if kind is None:
            return
        record = parse(kind, content, str(self.path))
        if isinstance(record, Statistics):
            self.statistics = record
        elif isinstance(record, ChunkIndexRecord):
            self.chunks.append(self._indexed_chunk(record))
        elif isinstance(record, AttachmentIndex):
            self.attachments.append(Span.whole(Opcode.ATTACHMENT, record.offset, record.length))
        elif isinstance(record, MetadataIndex):
            self.metadata.append(Span.whole(Opcode.METADATA, record.offset, record.length))
        else:
            self._take_definition(record)

    def _take_definition(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.channels[record.id] = record

    def _indexed_chunk(self, index: ChunkIndexRecord) -> ChunkPlace:
        span = Span.whole(Opcode.CHUNK, index.chunk_start_offset, index.chunk_length)
        index_end = span.end + index.message_index_length
        if span.length < 0 or index_end > self._size:
            raise InputError(f"{self.path}: the index points outside the data section")
        return ChunkPlace(span, index_end)

    def _summary_suffices(self) -> bool:
        """Return whether the summary has all channels and chunks; else the file is walked over."""
        statistics = self.statistics
        if statistics is None:
            return bool(self.channels and self.chunks)
        if statistics.message_count == 0:
            return bool(self.channels) or statistics.channel_count == 0
        return bool(self.channels and self.chunks) and statistics.chunk_count == len(self.chunks)

    def _scan(self, start: int) -> None:
        self.chunks, self.attachments, self.metadata = [], [], []
        self.end, closed = start, False
        for span in spans(self._file, start, self._size):
            closed = span.opcode in (Opcode.DATA_END, Opcode.FOOTER)
            if closed:
                break
            self._take_data(span)
            self.end = span.end
        if self.complete and not closed:
            raise InputError(f"{self.path}: no record at byte {self.end}")
        if closed:
            self.end = self._size
        for place in self.chunks:
            self._take_definitions(place)

    def _take_data(self, span: Span) -> None:
        if span.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            kind = _DEFINITIONS[span.opcode]
            self._take_definition(parse(kind, self._content(span), str(self.path)))
        elif span.opcode == Opcode.CHUNK:
            self.chunks.append(ChunkPlace(span, span.end))
        elif span.opcode == Opcode.MESSAGE_INDEX and self.chunks:
            if self.chunks[-1].index_end == span.offset:
                self.chunks[-1] = self.chunks[-1]._replace(index_end=span.end)
        elif span.opcode == Opcode.MESSAGE:
            self._take_loose(span)
        elif span.opcode == Opcode.ATTACHMENT:
            self.attachments.append(span)
        elif span.opcode == Opcode.METADATA:
            self.metadata.append(span)

    def _take_loose(self, span: Span) -> None:
        """Put a message outside any chunk to the run before it, or begin one."""
        last = self.chunks[-1] if self.chunks else None
        if last and last.loose and last.index_end == span.offset and last.record.length < _RUN:
            run = last.record._replace(length=last.record.length + HEAD.size + span.length)
        else:
            run = span
            self.chunks.append(ChunkPlace(run, run.end, loose=True))
        self.chunks[-1] = ChunkPlace(run, run.end, loose=True)

    def _take_definitions(self, place: ChunkPlace) -> None:
        """Take the schemas and channels in a chunk whose messages need them.

        Raises:
            InputError: messages of a channel that no record describes.
        """
        used = set(self.index(place) or ())
        if used and used <= self.channels.keys():
            return
        try:
            messages, content = self.messages(place), self.chunk_content(place)
        except InputError:
            # A damaged chunk is refused when its messages are asked for; the others are good.
            return
        for span in other_records(content):
            if span.opcode in _DEFINITIONS:
                kind = _DEFINITIONS[span.opcode]
                record = parse(kind, content[span.content : span.end], self._where(place))
                self._take_definition(record)
        unknown = set(messages.channels.tolist()) - self.channels.keys()
        if unknown:
            raise InputError(
                f"{self._where(place)}: messages on channel {min(unknown)}, which no record"
                " describes"
            )

    def _where(self, place: ChunkPlace) -> str:
        return f"{self.path}: chunk at byte {place.record.offset}"

    def topic_of(self, channel: int) -> str:
        """Return the topic of a channel.

        Raises:
            InputError: no record describes the channel.
        """
        if channel not in self.channels:
            raise InputError(
                f"{self.path}: messages on channel {channel}, which no record describes"
            )
        return self.channels[channel].topic

    @property
    def admitted(self) -> list[Channel]:
        """The channels but those of messages that nobody of the recorded run obeyed."""
        return [each for each in self.channels.values() if REFUSED not in each.metadata]

    def check_not_bare(self) -> None:
        """Refuse a file that was not closed and lists no message.

        Raises:
            BareFileError: it is such a file.
        """
        if not (self.complete or self.channels):
            raise BareFileError(f"{self.path}: not closed, and holds no channel and no message")

    def record_bytes(self, start: int, end: int) -> bytes:
        """Return the file's bytes between two offsets.

        Raises:
            InputError: they cannot be read.
        """
        return read_at(self._file, start, end - start, self.path)

    @property
    def size(self) -> int:
        """Length of the file [bytes]."""
        return self._size

    def index(self, place: ChunkPlace) -> ChunkIndex | None:
        """Return what the Message Index records after a chunk say, None without any.

        Of the last chunk of a file that was not closed some may be missing: None as well.
        """
        if not self.complete and place is self.chunks[-1]:
            return None
        stored = read_index(self.record_bytes(place.record.end, place.index_end))
        return None if stored is None else index_in_time(stored)

    def late_in(self, place: ChunkPlace) -> Counter[int]:
        """Return how many of a chunk's messages are left out, see `log_time`, by channel id.

        Raises:
            InputError: the chunk is damaged.
        """
        if not place.loose and self.head(place).last_ns <= LATEST_NS:
            return Counter()
        stored = read_messages(self.chunk_content(place), None, self._where(place))
        return Counter(stored.channels[stored.prefixes["log"] > LATEST_NS].tolist())

    @cached_property
    def late(self) -> Counter[int]:
        """Number of messages that are left out, see `log_time`, by channel id."""
        found: Counter[int] = Counter()
        if self.statistics is None or self.statistics.message_end_time > LATEST_NS:
            for place in self.chunks:
                with suppress(InputError):
                    found += self.late_in(place)
        return found

    @property
    def left_out(self) -> list[str]:
        """What there is to say of messages that are left out, a line or none."""
        return left_out(self.path, self.late.total())

    def span(self, place: ChunkPlace) -> tuple[int, int] | None:
        """Return first and last log time of a chunk [ns], None if it has no message.

        Raises:
            InputError: the chunk is damaged.
        """
        if not place.loose:
            head = self.head(place)
            # Writers say 0 or nonsense of a chunk without messages, and 0 may also be a log time.
            if 0 < head.first_ns <= head.last_ns <= LATEST_NS:
                return head.first_ns, head.last_ns
        times = [table[:, 0] for table in self.times(place).values() if len(table)]
        if not times:
            return None
        return min(int(t.min()) for t in times), max(int(t.max()) for t in times)

    def head(self, place: ChunkPlace) -> ChunkHead:
        """Return what precedes a chunk's data.

        Raises:
            InputError: the record is damaged.
        """
        if place.loose:
            size = HEAD.size + place.record.length
            return ChunkHead(0, 0, size, 0, "", -HEAD.size, size)
        length = min(place.record.length, _HEAD_SIZE)
        content = self.record_bytes(place.record.content, place.record.content + length)
        return chunk_head(content, place.record.length, self._where(place))

    def drop_damaged(self) -> list[str]:
        """Take chunks that cannot be read out of the list; return why, one line each."""
        whole, faults = [], []
        for place in self.chunks:
            try:
                self.messages(place, self.index(place))
            except InputError as err:
                faults.append(str(err))
            else:
                whole.append(place)
        self.chunks = whole
        return faults

    def chunk_data(self, place: ChunkPlace, head: ChunkHead) -> bytes:
        """Return a chunk's data as they are in the file."""
        start = place.record.content + head.data
        return self.record_bytes(start, start + head.data_size)

    def chunk_content(self, place: ChunkPlace) -> bytes:
        """Return a chunk's decompressed content.

        Raises:
            InputError: it is damaged.
        """
        head = self.head(place)
        return decompress(self.chunk_data(place, head), head, self._where(place))

    def messages(self, place: ChunkPlace, index: ChunkIndex | None = None) -> Messages:
        """Return a chunk's messages; `index` is what `index` returned for it, if it is known.

        Raises:
            InputError: it is damaged.
        """
        content = self.chunk_content(place)
        return in_time(read_messages(content, index or self.index(place), self._where(place)))

    def times(self, place: ChunkPlace) -> ChunkIndex:
        """Return log time and offset of each message of a chunk, shape (n, 2), by channel id.

        From the Message Index where there is one, else from the chunk.

        Raises:
            InputError: the index contradicts the chunk's head, or the chunk is damaged.
        """
        index = self.index(place)
        if index is None:
            return self.messages(place).index()
        head = self.head(place)
        for table in index.values():
            if len(table) and not (
                head.first_ns <= table[:, 0].min() <= table[:, 0].max() <= head.last_ns
            ):
                raise InputError(f"{self._where(place)}: its index has other times than it")
        return index

    def attachment(self, place: Span) -> Attachment:
        """Return the attachment at one of `attachments`.

        Raises:
            InputError: it is damaged.
        """
        return parse_attachment(self._content(place), f"{self.path}: byte {place.offset}")

    def metadata_record(self, place: Span) -> Metadata:
        """Return the metadata record at one of `metadata`.

        Raises:
            InputError: it is damaged.
        """
        return parse(Metadata, self._content(place), f"{self.path}: byte {place.offset}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _reason(err: OSError) -> str:
    return "no such file" if isinstance(err, FileNotFoundError) else str(err.strerror)


_DEFINITIONS: dict[int, type[McapRecord]] = {Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel}
_SUMMARY_KINDS: dict[int, type[McapRecord]] = {
    **_DEFINITIONS,
    Opcode.STATISTICS: Statistics,
    Opcode.CHUNK_INDEX: ChunkIndexRecord,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.METADATA_INDEX: MetadataIndex,
}
