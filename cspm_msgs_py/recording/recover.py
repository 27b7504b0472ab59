"""Restoring a recording that was not closed: every complete message, with index and metadata."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.records import Channel, Chunk, Header, Schema

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.recording.block import compress
from cspm_msgs_py.recording.chunk import (
    ChunkHead,
    ChunkPlace,
    chunk_head,
    other_records,
    scan_messages,
)
from cspm_msgs_py.recording.log_time import in_time, left_out, rewritten
from cspm_msgs_py.recording.mcap_file import BareFileError, McapFile
from cspm_msgs_py.recording.reader import message_counts, message_type
from cspm_msgs_py.recording.records import HEAD, ROS1_MAGIC, Opcode, parse, spans_in, starts_with
from cspm_msgs_py.recording.rosbag2_metadata import (
    FILE_NAME,
    FileEntry,
    TopicEntry,
    read_bag,
    write_metadata,
)
from cspm_msgs_py.recording.sink import McapSink
from cspm_msgs_py.yaml_file import parse_yaml

BROKEN_SUFFIX = ".broken"
_COMPRESSION_LEVEL = 1
Item = TypeVar("Item")


class _Result(NamedTuple):
    """What of one file is not in its copy: damaged records, unused bytes, and lines on the rest."""

    damaged: int
    lost_bytes: int
    left_out: list[str]


@dataclass(frozen=True)
class RecoveryReport:
    """What was restored.

    Attributes:
        path: the recording that is whole now.
        restored: its files that were not; empty if all were closed and nothing was done.
        kept: where the originals are now.
        counts: messages by topic, of the whole recording.
        end_ns: log time of the last message [ns], 0 without any.
        damaged: chunks and attachments left out because their content is damaged.
        bare: files left out because they hold nothing.
        described: whether `metadata.yaml` was written.
        lost_bytes: what could not be used at the ends of the files [bytes].
        left_out: lines about messages with impossible log times; see `log_time`.
    """

    path: Path
    restored: list[Path]
    kept: list[Path]
    counts: dict[str, int]
    end_ns: int
    damaged: int
    lost_bytes: int
    bare: list[Path]
    described: bool
    left_out: list[str]

    @property
    def messages(self) -> int:
        """Number of messages in the recording."""
        return sum(self.counts.values())


def recover(path: Path, out: Path | None = None) -> RecoveryReport:
    """Restore a recording so that every reader can use it.

    Files that were closed and can be read throughout are left alone. Any other is written anew
    beside the original, which is then kept under its name with `.broken` added; at every instant
    one of the two has its name.

    Args:
        path: a rosbag2 folder, with or without `metadata.yaml`, an MCAP file, or a ROS 1 `.bag`.
        out: a new folder for the restored recording; absent: in place.

    Raises:
        InputError: nothing to restore there, or `out` or a `.broken` file exists.
        CspmError: the restored file cannot be written.
    """
    path = Path(path)
    if path.is_file() and starts_with(path, ROS1_MAGIC):
        # It reads recordings as well.
        from cspm_msgs_py.bag.ros1_restore import recover_ros1

        return recover_ros1(path, None if out is None else Path(out))
    found, packed = _files(path)
    bare = [file for file in found if _is_bare(file)] if len(found) > 1 else []
    files = [file for file in found if file not in bare] or found
    try:
        if out is not None:
            return _restore_to(files, bare, Path(out), packed=packed)
        return _restore_in_place(path, files, bare, packed=packed)
    except OSError as err:
        raise CspmError(f"{path}: cannot be restored ({err.strerror})") from None


def _files(path: Path) -> tuple[list[Path], bool]:
    """Return the files of a recording, and whether their messages are compressed one by one."""
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if not path.is_dir():
        return [path], False
    if (path / FILE_NAME).exists():
        with suppress(InputError):
            bag = read_bag(path, compressions=("none", "message"))
            return bag.files, bag.compression == "message"
    files = sorted(path.glob("*.mcap"))
    if not files:
        raise InputError(f"{path}: a folder without MCAP files, allowed: a rosbag2 folder")
    return files, False


def _is_bare(path: Path) -> bool:
    try:
        with McapFile(path) as file:
            file.check_not_bare()
    except BareFileError:
        return True
    except InputError:
        return False
    return False


def _restore_in_place(
    path: Path, files: list[Path], bare: list[Path], *, packed: bool
) -> RecoveryReport:
    restored, kept, results = [], [], list[_Result]()
    for file in files:
        if _is_whole(file):
            continue
        broken, beside = Path(f"{file}{BROKEN_SUFFIX}"), Path(f"{file}.restoring")
        if broken.exists():
            raise InputError(f"{broken}: already exists, allowed: move it away first")
        results.append(_restore(file, beside))
        exchange(file, beside, broken)
        restored.append(file)
        kept.append(broken)
    folder = path if path.is_dir() else path.parent
    write = False
    if path.is_dir() or (folder / FILE_NAME).exists():
        files, packed = (files, packed) if path.is_dir() else _files(folder)
        write = bool(restored or bare) or not _has_metadata(folder)
    found = _describe(folder, files, write=write, packed=packed)
    return _report(path, restored, kept, found, results, bare, described=write)


def _has_metadata(folder: Path) -> bool:
    try:
        return not read_bag(folder, compressions=("none", "message")).faults
    except InputError:
        return False


def _restore_to(files: list[Path], bare: list[Path], out: Path, *, packed: bool) -> RecoveryReport:
    refuse_existing(out)
    out.mkdir(parents=True)
    targets, results = [], []
    for i, file in enumerate(files):
        targets.append(out / f"{out.name}_{i}.mcap")
        results.append(_restore(file, targets[-1]))
    found = _describe(out, targets, write=True, packed=packed)
    return _report(out, targets, files, found, results, bare, described=True)


def _report(
    path: Path,
    restored: list[Path],
    kept: list[Path],
    found: tuple[dict[str, int], int],
    results: list[_Result],
    bare: list[Path],
    *,
    described: bool,
) -> RecoveryReport:
    damaged, lost = sum(r.damaged for r in results), sum(r.lost_bytes for r in results)
    late = [line for each in results for line in each.left_out]
    return RecoveryReport(path, restored, kept, *found, damaged, lost, bare, described, late)


def exchange(file: Path, beside: Path, broken: Path) -> None:
    """Give `beside` the name of `file`, and that the name `broken`."""
    try:
        os.link(file, broken)
    except OSError:
        os.rename(file, broken)
    os.replace(beside, file)


def _is_whole(path: Path) -> bool:
    try:
        with McapFile(path) as file:
            listed = bool(file.statistics or file.chunks or not file.channels)
            return file.complete and listed and not file.drop_damaged() and not file.late
    except InputError:
        return False


def _restore(path: Path, target: Path) -> _Result:
    """Write what is whole in a file to `target`; return what is not."""
    with McapFile(path, use_summary=False) as source:
        tail, rest = _tail(source)
        _take_definitions(source, tail)
        source.check_not_bare()
        sink = McapSink(target, Header(source.profile, source.library))
        try:
            damaged, late = _copy(source, tail, sink)
            sink.finish()
        except BaseException:
            sink.close()
            target.unlink(missing_ok=True)
            raise
        return _Result(damaged, rest, left_out(path, late))


def _copy(source: McapFile, tail: bytes, sink: McapSink) -> tuple[int, int]:
    damaged, late = 0, source.late.total()
    for schema in source.schemas.values():
        sink.add_schema(schema)
    for channel in source.channels.values():
        sink.add_channel(channel)
    for get, places, put in (
        (source.metadata_record, source.metadata, sink.add_metadata),
        (source.attachment, source.attachments, sink.add_attachment),
    ):
        damaged += sum(not _try(get, place, put) for place in places)
    compressor = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL)
    for place in source.chunks:
        damaged += not _copy_chunk(source, place, sink, compressor)
    if tail:
        whole = scan_messages(tail, str(source.path))
        kept = rewritten(in_time(whole), str(source.path))
        late += len(whole) - len(kept)
        if index := kept.index():
            sink.add_chunk(compress(kept.content, index, compressor), index)
    return damaged, late


def _try(get: Callable[[Any], Item], place: object, put: Callable[[Any], None]) -> bool:
    try:
        item = get(place)
    except InputError:
        return False
    put(item)
    return True


def _copy_chunk(
    source: McapFile, place: ChunkPlace, sink: McapSink, compressor: zstandard.ZstdCompressor
) -> bool:
    """Copy a chunk and index it anew; return whether it was whole."""
    try:
        head, messages = source.head(place), source.messages(place)
        late = source.late_in(place)
        messages = rewritten(messages, str(source.path)) if late else messages
    except InputError:
        return False
    index = messages.index()
    if not index:
        return True
    if place.loose or late:
        chunk = compress(messages.content, index, compressor)
    else:
        logs = messages.prefixes["log"]
        chunk = Chunk(
            compression=head.compression,
            data=source.chunk_data(place, head),
            message_start_time=int(logs.min()),
            message_end_time=int(logs.max()),
            uncompressed_crc=head.crc,
            uncompressed_size=head.size,
        )
    sink.add_chunk(chunk, index)
    return True


def _tail(source: McapFile) -> tuple[bytes, int]:
    """Return the complete records of a chunk that the end of the file cuts, and the bytes unused.

    What a compressed chunk holds up to the cut is decompressed as far as it goes.
    """
    rest = source.record_bytes(source.end, source.size)
    if len(rest) < HEAD.size or rest[0] != Opcode.CHUNK:
        return b"", len(rest)
    where = f"{source.path}: chunk at byte {source.end}"
    _, length = HEAD.unpack_from(rest)
    try:
        head = chunk_head(rest[HEAD.size :], length, where)
    except InputError:
        return b"", len(rest)
    content = _decompress_part(rest[HEAD.size + head.data :], head)
    spans = list(spans_in(content))
    if not spans:
        return b"", len(rest)
    content = content[: spans[-1].end]
    known = {*source.channels, *_channels_in(content)}
    try:
        used = set(scan_messages(content, where).channels.tolist())
    except InputError:
        return b"", len(rest)
    return (content, 0) if used and used <= known else (b"", len(rest))


def _channels_in(content: bytes) -> set[int]:
    return {
        int.from_bytes(content[span.content : span.content + 2], "little")
        for span in other_records(content)
        if span.opcode == Opcode.CHANNEL
    }


def _decompress_part(data: bytes, head: ChunkHead) -> bytes:
    try:
        if head.compression == "zstd":
            return bytes(zstandard.ZstdDecompressor().decompressobj().decompress(data))
        if head.compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data))
    except (zstandard.ZstdError, RuntimeError, MemoryError):
        return b""
    return data if head.compression == "" else b""


def _take_definitions(source: McapFile, content: bytes) -> None:
    for span in other_records(content):
        body = content[span.content : span.end]
        if span.opcode == Opcode.SCHEMA:
            schema = parse(Schema, body, str(source.path))
            source.schemas.setdefault(schema.id, schema)
        elif span.opcode == Opcode.CHANNEL:
            channel = parse(Channel, body, str(source.path))
            source.channels.setdefault(channel.id, channel)


def _describe(
    folder: Path, paths: list[Path], *, write: bool, packed: bool
) -> tuple[dict[str, int], int]:
    """Return messages by topic and the last log time; write `metadata.yaml` if asked to."""
    entries: list[FileEntry] = []
    channels: dict[str, tuple[McapFile, Channel]] = {}
    counts: Counter[str] = Counter()
    with ExitStack() as stack:
        for path in paths:
            file = stack.enter_context(McapFile(path))
            found = message_counts(file)
            for channel in file.channels.values():
                channels.setdefault(channel.topic, (file, channel))
                counts[channel.topic] += found[channel.id]
            entries.append(_file_entry(file, found.total()))
        topics = [
            _topic_entry(file, channel, counts[name]) for name, (file, channel) in channels.items()
        ]
    if write:
        write_metadata(folder, topics, entries, message_zstd=packed)
    return {topic.name: topic.count for topic in topics}, max(e.last_ns for e in entries)


def _file_entry(file: McapFile, count: int) -> FileEntry:
    heads = [file.head(place) for place in file.chunks]
    first = min((head.first_ns for head in heads), default=0)
    last = max((head.last_ns for head in heads), default=0)
    return FileEntry(file.path.name, first, last, count)


def _topic_entry(file: McapFile, channel: Channel, count: int) -> TopicEntry:
    ros_type = message_type(file, channel)
    qos: list[dict[str, Any]] = []
    with suppress(InputError):
        qos = parse_yaml(channel.metadata.get("offered_qos_profiles", ""), channel.topic) or []
    hash_ = channel.metadata.get("topic_type_hash", "")
    return TopicEntry(channel.topic, ros_type, hash_, qos, count, channel.message_encoding)
