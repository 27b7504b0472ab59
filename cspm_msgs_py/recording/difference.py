"""Whether two recordings hold the same messages, bit for bit in every field."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.message import NANOSECONDS, carries_row, topic_of
from cspm_msgs_py.recording.chunk import ChunkPlace
from cspm_msgs_py.recording.mcap_file import McapFile
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.ros_types import deserialize, serialize


@dataclass(frozen=True)
class Difference:
    """The first place where two recordings differ.

    Attributes:
        topic: topic name.
        index: number of the message among those of its topic, from 0; None for a whole topic.
        stamp_ns: the first recording's stamp there, or its log time if the type has none [ns].
        field: column of the row or path in the message; `topic`, `type`, `message` (there or
            not), `stamp`, `log_time` or `bytes` otherwise.
        first: value in the first recording.
        second: value in the second recording.
    """

    topic: str
    index: int | None
    stamp_ns: int | None
    field: str
    first: object
    second: object

    def __str__(self) -> str:
        at = "" if self.stamp_ns is None else f" at {self.stamp_ns / NANOSECONDS:.9f} s"
        number = "" if self.index is None else f" message {self.index}{at}"
        return f"{self.topic}{number}: {self.field} {self.first!r} against {self.second!r}"


class _Message(NamedTuple):
    log_ns: int
    payload: bytes


class _Place(NamedTuple):
    file: McapFile
    chunk: ChunkPlace


def first_difference(
    first: Recording,
    second: Recording,
    *,
    log_times: bool = True,
    but: Collection[str] = (),
) -> Difference | None:
    """Return where two recordings first differ, None if every message is identical.

    Compared are topics, types, and per topic the sequence of messages: all fields by their bits
    (NaN equals the same NaN, 0.0 differs from -0.0) and, unless `log_times` is False, when they
    were recorded. Chunks, compression, order across topics and padding do not matter. Topics in
    `but` are left out.

    Raises:
        InputError: one of the two is damaged.
    """
    found = _topic_difference(first, second, but)
    if found:
        return found
    places = [_places(first), _places(second)]
    equal = sum(1 for _ in _equal_chunks(*places))
    streams = [_Stream(own[equal:]) for own in places]
    types = {name: info.ros_type for name, info in first.topics.items() if name not in but}
    found = _message_difference(types, streams, log_times=log_times)
    if found is None or found.index is None:
        return found
    return replace(found, index=found.index + _count(places[0][:equal], found.topic))


def _topic_difference(
    first: Recording, second: Recording, but: Collection[str]
) -> Difference | None:
    for name in [name for name in {**first.topics, **second.topics} if name not in but]:
        one, other = first.topics.get(name), second.topics.get(name)
        if one is None or other is None:
            state = ["missing" if info is None else "present" for info in (one, other)]
            return Difference(name, None, None, "topic", *state)
        if one.ros_type != other.ros_type:
            return Difference(name, None, None, "type", one.ros_type, other.ros_type)
    return None


def _places(recording: Recording) -> list[_Place]:
    return [_Place(file, chunk) for file in recording.files for chunk in file.chunks]


def _equal_chunks(first: list[_Place], second: list[_Place]) -> Iterator[None]:
    """Yield once for each pair of chunks with equal content, up to the first that differs."""
    for one, other in zip(first, second, strict=False):
        if _channel_names(one.file) != _channel_names(other.file):
            return
        if _raw(one) != _raw(other) and (
            one.file.chunk_content(one.chunk) != other.file.chunk_content(other.chunk)
        ):
            return
        yield


def _channel_names(file: McapFile) -> dict[int, str]:
    return {channel.id: channel.topic for channel in file.channels.values()}


def _raw(place: _Place) -> tuple[str, bytes]:
    head = place.file.head(place.chunk)
    return head.compression, place.file.chunk_data(place.chunk, head)


def _count(places: list[_Place], topic: str) -> int:
    """Return the number of messages of a topic in some chunks."""
    count = 0
    for file, chunk in places:
        ids = [channel.id for channel in file.channels.values() if channel.topic == topic]
        count += len(file.messages(chunk).select(ids))
    return count


class _Stream:
    """Messages by topic, loaded chunk by chunk and dropped once compared."""

    def __init__(self, places: list[_Place]) -> None:
        self._places = iter(places)
        self.waiting: dict[str, list[_Message]] = {}
        self.reached = -1
        self.exhausted = False

    def advance(self) -> None:
        """Load the next chunk."""
        place = next(self._places, None)
        if place is None:
            self.exhausted = True
            return
        messages = place.file.messages(place.chunk)
        logs = messages.logs.tolist()
        found = zip(messages.channels.tolist(), logs, messages.payloads(), strict=True)
        for channel, log, payload in found:
            self.waiting.setdefault(place.file.topic_of(channel), []).append(_Message(log, payload))
        self.reached = max([self.reached, *logs])


def _message_difference(
    types: Mapping[str, str], streams: list[_Stream], *, log_times: bool
) -> Difference | None:
    one, other = streams
    done: Counter[str] = Counter()
    while running := [stream for stream in streams if not stream.exhausted]:
        min(running, key=lambda stream: stream.reached).advance()
        found = [
            candidate
            for name in types
            if (candidate := _compare_topic(name, types[name], one, other, done, log_times))
        ]
        if found:
            candidate = min(found, key=lambda candidate: candidate.message.log_ns)
            stamp = _stamp(types[candidate.topic], candidate.message)
            return Difference(
                candidate.topic, candidate.number, stamp, candidate.field, *candidate.values
            )
    return None


class _Candidate(NamedTuple):
    topic: str
    number: int
    field: str
    values: tuple[object, object]
    message: _Message


def _compare_topic(
    name: str, ros_type: str, one: _Stream, other: _Stream, done: Counter[str], log_times: bool
) -> _Candidate | None:
    """Compare what both streams have of a topic, drop it, and return what differs first."""
    mine, theirs = one.waiting.get(name, []), other.waiting.get(name, [])
    common = min(len(mine), len(theirs))
    found = _first_unequal(mine[:common], theirs[:common], ros_type, log_times)
    if found is not None:
        i, (field, values) = found
        return _Candidate(name, done[name] + i, field, values, mine[i])
    done[name] += common
    del mine[:common], theirs[:common]
    if mine and other.exhausted:
        return _Candidate(name, done[name], "message", ("present", "missing"), mine[0])
    if theirs and one.exhausted:
        return _Candidate(name, done[name], "message", ("missing", "present"), theirs[0])
    return None


_FieldValues = tuple[str, tuple[object, object]]


def _first_unequal(
    mine: list[_Message], theirs: list[_Message], ros_type: str, log_times: bool
) -> tuple[int, _FieldValues] | None:
    for i, (one, other) in enumerate(zip(mine, theirs, strict=True)):
        if one == other:
            continue
        found = _payload_difference(ros_type, one.payload, other.payload)
        if found is None and log_times and one.log_ns != other.log_ns:
            found = ("log_time", (one.log_ns, other.log_ns))
        if found is not None:
            return i, found
    return None


def _payload_difference(ros_type: str, one: bytes, other: bytes) -> _FieldValues | None:
    if one == other:
        return None
    try:
        messages = [deserialize(payload, ros_type) for payload in (one, other)]
    except InputError:
        return "bytes", (one.hex(), other.hex())
    if serialize(messages[0]) == serialize(messages[1]):
        return None
    return _row_difference(ros_type, *messages) or _walk(messages[0], messages[1], "")


def _row_difference(ros_type: str, one: Any, other: Any) -> _FieldValues | None:  # noqa: ANN401
    """Return the stamp or column that differs, None if it is something else."""
    if not carries_row(ros_type):
        return None
    try:
        topics = [topic_of("", message) for message in (one, other)]
        layouts = [layout_of(topic) for topic in topics]
    except InputError:
        return None
    if topics[0] != topics[1]:
        return None
    contents = [np.frombuffer(serialize(message), np.uint8)[None] for message in (one, other)]
    (stamps, rows), (other_stamps, other_rows) = (
        layout.decode(content) for layout, content in zip(layouts, contents, strict=True)
    )
    if stamps[0] != other_stamps[0]:
        return "stamp", (int(stamps[0]), int(other_stamps[0]))
    unequal = np.flatnonzero(rows[0].view(np.int64) != other_rows[0].view(np.int64))
    if not len(unequal):
        return None
    column = int(unequal[0])
    return topics[0].fields[column], (float(rows[0, column]), float(other_rows[0, column]))


def _walk(one: Any, other: Any, path: str) -> _FieldValues | None:  # noqa: ANN401 - any message
    """Return the path of the first leaf that differs between two messages of one type."""
    if hasattr(one, "__msgtype__"):
        pairs = [
            (f"{path}.{name}" if path else name, getattr(one, name), getattr(other, name))
            for name in one.__dataclass_fields__
        ]
    elif isinstance(one, list | tuple | np.ndarray):
        if len(one) != len(other):
            return f"{path} length", (len(one), len(other))
        pairs = [(f"{path}[{i}]", a, b) for i, (a, b) in enumerate(zip_longest(one, other))]
    else:
        return None if _bits(one) == _bits(other) else (path, (one, other))
    for name, a, b in pairs:
        found = _walk(a, b, name)
        if found:
            return found
    return None


def _bits(leaf: object) -> object:
    return struct.pack("<d", leaf) if isinstance(leaf, float) else leaf


def _stamp(ros_type: str, message: _Message) -> int:
    try:
        content = deserialize(message.payload, ros_type)
    except InputError:
        return message.log_ns
    stamp = getattr(content, "clock", None) or getattr(
        getattr(content, "header", None), "stamp", None
    )
    return message.log_ns if stamp is None else stamp.sec * NANOSECONDS + stamp.nanosec
