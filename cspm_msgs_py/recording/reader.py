"""A recording being read: by this project or by others, closed or killed, indexed or not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording.chunk import Messages
from cspm_msgs_py.recording.closing import Closing
from cspm_msgs_py.recording.mcap_file import BareFileError, McapFile
from cspm_msgs_py.recording.rosbag2_metadata import read_bag
from cspm_msgs_py.recording.rows import RowCollector, Rows
from cspm_msgs_py.ros_types import MESSAGE_ENCODING, check_definition
from cspm_msgs_py.topics import Topic


@dataclass(frozen=True)
class TopicInfo:
    """Type and number of messages of a recorded topic; several types are joined by commas."""

    ros_type: str
    count: int


class Payloads(NamedTuple):
    """The messages of one topic as bytes, in order of log time.

    Attributes:
        log_ns: when each was recorded [ns], shape (n,).
        payloads: their bytes.
    """

    log_ns: NDArray[np.int64]
    payloads: list[bytes]


class Recording(Closing):
    """A rosbag2 folder with MCAP files, or one MCAP file.

    Attributes:
        path: what was opened.
        files: its MCAP files, in order.
        bare: files that their writer left without a message, and are not read.
    """

    def __init__(self, path: Path, *, compressions: Sequence[str] = ("none",)) -> None:
        """Open a recording.

        Args:
            path: a folder or file.
            compressions: see `read_bag`.

        Raises:
            InputError: missing, damaged beyond use, or not stored as MCAP.
        """
        self.path = path = Path(path)
        self.files: list[McapFile] = []
        self.bare: list[Path] = []
        self._checked: set[str] = set()
        paths = mcap_paths(path, compressions=compressions)
        try:
            for file in paths:
                self._open(file, len(paths))
        except BaseException:
            self.close()
            raise

    def _open(self, path: Path, count: int) -> None:
        """Open one of some files; leave it out if it holds nothing, but not all of them."""
        try:
            self.files.append(McapFile(path))
            self.files[-1].check_not_bare()
        except BareFileError:
            if len(self.bare) + 1 == count:
                raise
            self.bare.append(path)
            for file in [file for file in self.files if file.path == path]:
                self.files.remove(file)
                file.close()

    @property
    def complete(self) -> bool:
        """Whether all files were closed by whatever wrote them."""
        return not self.bare and all(file.complete for file in self.files)

    @property
    def left_out(self) -> list[str]:
        """What there is to say of messages that are left out, a line a file; see `log_time`."""
        return [line for file in self.files for line in file.left_out]

    @cached_property
    def topics(self) -> dict[str, TopicInfo]:
        """Type and number of messages by topic name."""
        types: dict[str, list[str]] = {}
        counts: Counter[str] = Counter()
        for file in self.files:
            found = message_counts(file)
            for channel in file.admitted:
                kind = message_type(file, channel)
                known = types.setdefault(channel.topic, [])
                known.extend([kind] if kind not in known else [])
                counts[channel.topic] += found[channel.id]
        return {name: TopicInfo(", ".join(types[name]), counts[name]) for name in types}

    @cached_property
    def refused(self) -> dict[str, int]:
        """Number of messages that nobody of the recorded run obeyed, by topic, `/refused/…`."""
        counts: Counter[str] = Counter()
        for file in self.files:
            found, admitted = message_counts(file), {each.id for each in file.admitted}
            for channel in file.channels.values():
                if channel.id not in admitted:
                    counts[channel.topic] += found[channel.id]
        return {name: count for name, count in counts.items() if count}

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """Attached files by name."""
        found = [file.attachment(place) for file in self.files for place in file.attachments]
        return {attachment.name: attachment.data for attachment in found}

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """Metadata records by name."""
        found = [file.metadata_record(place) for file in self.files for place in file.metadata]
        return {record.name: dict(record.metadata) for record in found}

    @cached_property
    def _span_ns(self) -> tuple[int, int]:
        first, last = 2**64 - 1, -1
        for file in self.files:
            for place in file.chunks:
                if span := file.span(place):
                    first, last = min(first, span[0]), max(last, span[1])
        return (first, last) if last >= 0 else (0, 0)

    @property
    def start_ns(self) -> int:
        """Earliest log time [ns]; 0 if there is no message."""
        return self._span_ns[0]

    @property
    def end_ns(self) -> int:
        """Latest log time [ns]; 0 if there is no message."""
        return self._span_ns[1]

    def rows(self, name: str) -> Rows:
        """Return the messages of a topic as stamps and rows.

        Raises:
            InputError: see `rows_of`.
        """
        return self.rows_of([name])[name]

    @property
    def chunks(self) -> int:
        """How many complete chunks there are; more, while the recording is being made."""
        return sum(len(file.chunks) for file in self.files)

    def rows_of(
        self, names: Iterable[str], until_ns: int | None = None, after: int = 0
    ) -> dict[str, Rows]:
        """Return the messages of several topics, reading the recording once.

        Args:
            names: of the topics.
            until_ns: the latest log time that is wanted [ns]; None: all are.
            after: how many chunks of a recording of one file are left out at its start.

        Raises:
            InputError: a topic is missing, has no row of numbers or another definition, or the
                recording is damaged.
        """
        collectors = self._collect(list(names), only_first=False, until_ns=until_ns, after=after)
        found = {name: collector.result() for name, collector in collectors.items()}
        if until_ns is not None:
            return {name: rows.until(until_ns) for name, rows in found.items()}
        if after:
            return found
        for name, rows in found.items():
            self._check_count(name, len(rows.log_ns))
        return found

    def topic(self, name: str) -> Topic:
        """Return a recorded topic with its frame, names and columns, from its first message.

        Raises:
            InputError: see `rows_of`; or the topic has no message.
        """
        collector = self._collect([name], only_first=True)[name]
        collector.result()
        if collector.topic is None:
            raise InputError(f"{self.path}: {name} has no message")
        return collector.topic

    def payloads(self, name: str) -> Payloads:
        """Return the messages of a topic as bytes.

        Raises:
            InputError: the topic is missing or the recording is damaged.
        """
        self._type_of_topic(name)
        found = list(self._messages([name]))
        logs = np.concatenate([np.zeros(0, dtype=np.int64), *(m.logs for _, m in found)])
        payloads = [payload for _, messages in found for payload in messages.payloads()]
        self._check_count(name, len(payloads))
        order = np.argsort(logs, kind="stable")
        return Payloads(logs[order], [payloads[i] for i in order])

    def _collect(
        self, names: list[str], *, only_first: bool, until_ns: int | None = None, after: int = 0
    ) -> dict[str, RowCollector]:
        collectors = {}
        for name in names:
            ros_type = self._type_of_topic(name)
            self._check_schema(name, ros_type)
            collectors[name] = RowCollector(name, ros_type, str(self.path))
        for name, messages in self._messages(names, until_ns, after):
            collectors[name].add(messages)
            if only_first:
                break
        return collectors

    def _messages(
        self, names: list[str], until_ns: int | None = None, after: int = 0
    ) -> Iterator[tuple[str, Messages]]:
        """Yield each topic's messages chunk by chunk, leaving out chunks that begin later."""
        for file in self.files:
            ids = {
                name: [channel.id for channel in file.admitted if channel.topic == name]
                for name in names
            }
            wanted = {channel for channels in ids.values() for channel in channels}
            for place in file.chunks[after:]:
                span = None if until_ns is None else file.span(place)
                if until_ns is not None and (span is None or span[0] > until_ns):
                    continue
                index = file.index(place)
                if index is None or not wanted.isdisjoint(index):
                    messages = file.messages(place, index)
                    yield from ((name, messages.select(ids[name])) for name in names)

    def _check_count(self, name: str, count: int) -> None:
        expected = self.topics[name].count
        if count != expected:
            raise InputError(
                f"{self.path}: {count} messages of {name}, but its index says {expected}"
            )

    def _type_of_topic(self, name: str) -> str:
        if name not in self.topics:
            raise InputError(
                f"{self.path}: no topic {name}, it has: {', '.join(self.topics) or 'none'}"
            )
        ros_type = self.topics[name].ros_type
        if ", " in ros_type:
            raise InputError(f"{self.path}: {name} has the types {ros_type}, allowed: one")
        return ros_type

    def _check_schema(self, name: str, ros_type: str) -> None:
        """Refuse a topic whose bytes cannot be what the type's name says."""
        if not carries_row(ros_type):
            raise InputError(f"{self.path}: {name}: {ros_type} carries no row of numbers")
        for file in self.files:
            for channel in file.channels.values():
                if channel.topic != name or ros_type in self._checked:
                    continue
                if channel.message_encoding != MESSAGE_ENCODING:
                    raise InputError(
                        f"{self.path}: {name} is encoded as {channel.message_encoding!r}, allowed:"
                        f" {MESSAGE_ENCODING}"
                    )
                schema = file.schemas[channel.schema_id]
                text = schema.data.decode("utf-8", errors="replace")
                try:
                    check_definition(ros_type, schema.encoding, text)
                except InputError as err:
                    raise InputError(f"{self.path}: {name}: {err}") from None
                self._checked.add(ros_type)

    def close(self) -> None:
        """Close all files."""
        for file in self.files:
            file.close()


def mcap_paths(path: Path, *, compressions: Sequence[str] = ("none",)) -> list[Path]:
    """Return the MCAP files of a recording: the file itself, or those of a rosbag2 folder.

    Args:
        path: the recording.
        compressions: see `read_bag`.

    Raises:
        InputError: it is missing or stored otherwise.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if not path.is_dir():
        return [path]
    bag = read_bag(path, compressions=compressions)
    if bag.storage != "mcap":
        raise InputError(f"{path}: stored as {bag.storage}, allowed: mcap")
    return bag.files


def message_type(file: McapFile, channel: Channel) -> str:
    """Return the name of a channel's schema, `none` if it has none."""
    schema = file.schemas.get(channel.schema_id)
    return schema.name if schema else "none"


def message_counts(file: McapFile) -> Counter[int]:
    """Return the number of messages by channel id, from the statistics or else the indexes."""
    if file.complete and file.statistics is not None:
        return Counter(file.statistics.channel_message_counts) - file.late
    counts: Counter[int] = Counter()
    for place in file.chunks:
        counts.update({channel: len(table) for channel, table in file.times(place).items()})
    return counts
