"""What is in a recording: topics, rates, gaps, duration, origin. For any bag."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.records import ROS1_MAGIC, starts_with
from cspm_msgs_py.recording.rosbag2_metadata import FILE_NAME, read_bag
from cspm_msgs_py.recording.run_record import RECORD_NAME, misfits
from cspm_msgs_py.yaml_file import parse_yaml

Times = NDArray[np.int64]
# Times are outside of what is compressed.
_COMPRESSIONS = ("none", "message")
_ALL_COMPRESSIONS = (*_COMPRESSIONS, "file")
_SQLITE = b"SQLite format 3\x00"
_EARLIEST_NS = -(2**63)


@dataclass(frozen=True)
class TopicOverview:
    """One topic.

    Attributes:
        name: topic name.
        ros_type: message type, several joined by commas.
        count: number of messages.
        rate_hz: mean rate between first and last message [Hz], None below two messages.
        first_ns: log time of the first message [ns], None without any.
        last_ns: log time of the last message [ns], None without any.
        gap_ns: longest time between two messages [ns], None below two messages.
        gap_at_ns: log time at which that gap begins [ns].
    """

    name: str
    ros_type: str
    count: int
    rate_hz: float | None
    first_ns: int | None
    last_ns: int | None
    gap_ns: int | None
    gap_at_ns: int | None


@dataclass(frozen=True)
class Overview:
    """A recording in numbers.

    Attributes:
        path: what was looked at.
        storage: `mcap`, `sqlite3`, or `rosbag1`.
        profile: profile of the MCAP file, such as `ros2`; empty for others.
        library: what wrote it.
        complete: whether it was closed; if not, `cspm recover` restores its index.
        faults: what is damaged or missing, one line each.
        unread_bytes: what follows the last complete record of files that were not closed [bytes].
        size_bytes: length of all files [bytes].
        start_ns: earliest log time [ns], 0 without messages.
        end_ns: latest log time [ns], 0 without messages.
        message_count: number of messages.
        topics: in the order of the recording.
        misfits: attachments and versions that do not fit the record, one line each.
        refused: number of messages that nobody of the run obeyed, by topic, `/refused/…`.
        attachments: length of each attached file [bytes] by name.
        metadata: metadata records by name.
        scenario: the name that the attached scenario gives itself, None without one.
        testbed: the name that the attached test-bed gives itself, None without one.
    """

    path: Path
    storage: str
    profile: str
    library: str
    complete: bool
    faults: list[str]
    unread_bytes: int
    size_bytes: int
    start_ns: int
    end_ns: int
    message_count: int
    topics: list[TopicOverview]
    attachments: dict[str, int]
    metadata: dict[str, dict[str, str]]
    scenario: str | None
    testbed: str | None
    misfits: list[str] = field(default_factory=list)
    refused: dict[str, int] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Time between the first and the last message [s]."""
        return (self.end_ns - self.start_ns) * 1e-9


def overview(path: Path) -> Overview:
    """Return what is in a recording.

    Raises:
        InputError: it is missing, damaged, or no bag.
    """
    path = Path(path)
    faults: list[str] = []
    if path.is_dir():
        bag = read_bag(path, compressions=_ALL_COMPRESSIONS)
        faults += bag.faults
        if bag.storage == "sqlite3" or bag.compression == "file":
            return _bag_overview(path)
    if path.is_file() and starts_with(path, _SQLITE, ROS1_MAGIC):
        return _bag_overview(path)
    with Recording(path, compressions=_COMPRESSIONS) as recording:
        faults += [f"{file}: not closed, and holds no message" for file in recording.bare]
        damaged = [fault for file in recording.files for fault in file.drop_damaged()]
        return _mcap_overview(recording, faults, damaged)


class _Gaps:
    """Count, ends and longest gap of a topic, from its times in pieces."""

    def __init__(self) -> None:
        self.count = 0
        self.first: int | None = None
        self.last: int | None = None
        self.gap: int | None = None
        self.gap_at: int | None = None
        self.ordered = True

    def add(self, times: Times) -> None:
        """Take the next times [ns], shape (n,), in any order among themselves."""
        if not len(times):
            return
        times = np.sort(times)
        if self.last is not None:
            self.ordered &= bool(times[0] >= self.last)
            times = np.concatenate([[self.last], times])
            self.count -= 1
        self.count += len(times)
        self.first = int(times[0]) if self.first is None else self.first
        self.last = int(times[-1])
        gaps = np.diff(times)
        if len(gaps) and (self.gap is None or gaps.max() > self.gap):
            self.gap = int(gaps.max())
            self.gap_at = int(times[np.argmax(gaps)])

    def topic(self, name: str, ros_type: str) -> TopicOverview:
        """Return the overview of the topic of which these are the times."""
        span = (self.last or 0) - (self.first or 0)
        rate = (self.count - 1) / (span * 1e-9) if span else None
        return TopicOverview(
            name, ros_type, self.count, rate, self.first, self.last, self.gap, self.gap_at
        )


def _gaps_of(
    names: Iterable[str], pieces: Callable[[], Iterable[tuple[str, Times]]]
) -> dict[str, _Gaps]:
    """Return the gaps of each topic; topics whose pieces overlap in time are gathered first."""
    gaps = {name: _Gaps() for name in names}
    for name, times in pieces():
        gaps[name].add(times)
    overlapping = {name for name, gap in gaps.items() if not gap.ordered}
    gathered: dict[str, list[Times]] = {name: [] for name in overlapping}
    for name, times in pieces() if overlapping else ():
        if name in overlapping:
            gathered[name].append(times)
    for name in overlapping:
        gaps[name] = _Gaps()
        gaps[name].add(np.concatenate(gathered[name]))
    return gaps


def _mcap_overview(recording: Recording, faults: list[str], damaged: list[str]) -> Overview:
    types = {name: info.ros_type for name, info in recording.topics.items()}
    gaps = _gaps_of(types, lambda: _chunk_times(recording))
    for name, info in recording.topics.items():
        if gaps[name].count != info.count and not damaged:
            raise InputError(
                f"{recording.path}: {gaps[name].count} messages of {name}, but its statistics say"
                f" {info.count}"
            )
    files = recording.files
    return Overview(
        path=recording.path,
        storage="mcap",
        profile=files[0].profile,
        library=files[0].library,
        complete=recording.complete,
        faults=[*faults, *damaged, *recording.left_out],
        unread_bytes=sum(0 if file.complete else file.size - file.end for file in files),
        size_bytes=sum(file.size for file in files),
        start_ns=recording.start_ns,
        end_ns=recording.end_ns,
        message_count=sum(gap.count for gap in gaps.values()),
        topics=[gaps[name].topic(name, ros_type) for name, ros_type in types.items()],
        attachments={name: len(content) for name, content in recording.attachments.items()},
        metadata=recording.metadata,
        scenario=_own_name(recording, "scenario.yaml"),
        testbed=_own_name(recording, "testbed.yaml"),
        misfits=misfits(recording.attachments, recording.metadata.get(RECORD_NAME, {})),
        refused=recording.refused,
    )


def _chunk_times(recording: Recording) -> Iterator[tuple[str, Times]]:
    for file in recording.files:
        for place in file.chunks:
            admitted = {channel.id for channel in file.admitted}
            for channel, table in file.times(place).items():
                if channel in file.channels and channel not in admitted:
                    continue
                yield file.topic_of(channel), table[:, 0].astype(np.int64)


def _own_name(recording: Recording, attachment: str) -> str | None:
    content = recording.attachments.get(attachment)
    if content is None:
        return None
    text = content.decode("utf-8", errors="replace")
    mapping = parse_yaml(text, f"{recording.path}: {attachment}")
    name = mapping.get("name") if isinstance(mapping, dict) else None
    return None if name is None else str(name)


def _bag_overview(path: Path) -> Overview:
    """Return what is in a bag that is no plain MCAP, as far as all writers say it."""
    # It reads recordings as well.
    from cspm_msgs_py.bag.conversion import ros2_type
    from cspm_msgs_py.bag.files import open_files

    types: dict[str, list[str]] = {}
    times: dict[str, list[int]] = {}
    with ExitStack() as stack:
        files, faults = open_files(path, stack, tolerant=True)
        for file in files:
            names = {channel.id: channel.topic for channel in file.channels}
            for channel in file.channels:
                types.setdefault(channel.topic, []).append(ros2_type(channel))
                times.setdefault(channel.topic, [])
            for run in file.runs:
                for log_ns, channel_id, _ in run.read(names.keys(), _EARLIEST_NS):
                    times[names[channel_id]].append(log_ns)
        faults = [*faults, *(fault for file in files for fault in file.faults)]
    arrays = [(name, np.array(found, dtype=np.int64)) for name, found in times.items()]
    gaps = _gaps_of(types, lambda: arrays)
    topics = [gaps[name].topic(name, ", ".join({*kinds})) for name, kinds in types.items()]
    return _bag_result(path, topics, faults)


def _bag_result(path: Path, topics: list[TopicOverview], faults: list[str]) -> Overview:
    files = [file for file in path.iterdir() if file.is_file()] if path.is_dir() else [path]
    return Overview(
        path=path,
        storage=_storage_of(path),
        profile="",
        library="",
        complete=True,
        faults=faults,
        unread_bytes=0,
        size_bytes=sum(file.stat().st_size for file in files if file.name != FILE_NAME),
        start_ns=min((t.first_ns for t in topics if t.first_ns is not None), default=0),
        end_ns=max((t.last_ns for t in topics if t.last_ns is not None), default=0),
        message_count=sum(topic.count for topic in topics),
        topics=topics,
        attachments={},
        metadata={},
        scenario=None,
        testbed=None,
    )


def _storage_of(path: Path) -> str:
    if path.is_dir():
        return read_bag(path, compressions=_ALL_COMPRESSIONS).storage
    return "rosbag1" if starts_with(path, ROS1_MAGIC) else "sqlite3"
