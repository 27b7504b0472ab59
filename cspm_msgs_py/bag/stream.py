"""A bag being streamed: ROS 2 messages in the order in which they were logged, whoever wrote it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from cspm_msgs_py.bag.conversion import Convert, converter, ros2_type
from cspm_msgs_py.bag.files import open_files
from cspm_msgs_py.bag.run import BagMessage, Run, StoredFile, StoredMessage, StoredRun, in_order
from cspm_msgs_py.closing import Closing
from cspm_msgs_py.errors import InputError

_EARLIEST_NS = -(2**63)


@dataclass(frozen=True)
class BagTopic:
    """A topic that can be played: its name, type `package/msg/Type` and number of messages."""

    name: str
    ros_type: str
    count: int


class BagStream(Closing):
    """A bag whose messages are read one after the other, never all at once.

    Memory holds the chunks that overlap in time, one by one in the bags of most writers.

    Attributes:
        path: what was opened.
        topics: the topics that can be played by name, in the bag's order; some may be empty.
        unplayable: for each other topic the reason, one line.
        start_ns: earliest log time of the bag [ns].
        end_ns: latest log time of the bag [ns].
    """

    def __init__(self, path: Path) -> None:
        """Open a bag; see `open_bag`.

        Raises:
            InputError: see `open_bag`.
        """
        self.path = path
        self._stack = ExitStack()
        try:
            self._files = open_files(path, self._stack)
            runs = [run for file in self._files for run in file.runs]
            if not runs:
                raise InputError(f"{path}: holds no message")
            self.start_ns = min(run.first_ns for run in runs)
            self.end_ns = max(run.last_ns for run in runs)
            self.topics, self.unplayable, self._routes = _plan(self._files)
        except BaseException:
            self.close()
            raise

    def messages(
        self, topics: Collection[str] | None = None, start_ns: int | None = None
    ) -> Iterator[BagMessage]:
        """Return the messages in order of log time.

        Messages of one log time come as they stand in the file, those of several files in the order
        of the files.

        Args:
            topics: names of the wanted topics; None for all that can be played.
            start_ns: only messages logged at or after it [ns].

        Raises:
            InputError: a topic is not in the bag or cannot be played, or none can; while messages
                are read: the bag is damaged.
        """
        wanted = self._wanted(topics)
        earliest = _EARLIEST_NS if start_ns is None else start_ns
        runs = []
        for file, routes in zip(self._files, self._routes, strict=True):
            chosen = {id_: route for id_, route in routes.items() if route.topic in wanted}
            runs += [
                Run(run.first_ns, run.last_ns, partial(_routed, self.path, run, chosen, earliest))
                for run in file.runs
                if chosen and run.last_ns >= earliest
            ]
        return in_order(runs)

    def _wanted(self, topics: Collection[str] | None) -> Collection[str]:
        if topics is None and not self.topics:
            first, reason = next(iter(self.unplayable.items()), ("", ""))
            raise InputError(f"{self.path}: no topic of it can be played, {first}: {reason}")
        for name in topics or ():
            if name in self.unplayable:
                raise InputError(f"{self.path}: {name} cannot be played: {self.unplayable[name]}")
            if name not in self.topics:
                raise InputError(
                    f"{self.path}: no topic {name}, it has: {', '.join(self.topics) or 'none'}"
                )
        return self.topics.keys() if topics is None else frozenset(topics)

    def close(self) -> None:
        """Close the files."""
        self._stack.close()


def open_bag(path: Path) -> BagStream:
    """Open a bag for streaming.

    Read are rosbag2 folders and their single `.mcap` and `.db3` files, among them this project's
    recordings, closed or cut short, and ROS 1 bags.

    Raises:
        InputError: it is missing, not a bag, damaged, stored in an unknown way, or without message.
    """
    return BagStream(Path(path))


class _Route(NamedTuple):
    """Where the messages of a stored channel go: the topic, and what converts them."""

    topic: str
    convert: Convert


_Routes = Mapping[int, _Route]


def _plan(
    files: Sequence[StoredFile],
) -> tuple[dict[str, BagTopic], dict[str, str], list[_Routes]]:
    """Return topics, reasons against playing the others, and per file the route of each channel."""
    types: dict[str, list[str]] = {}
    counts: dict[str, int] = {}
    for file in files:
        for channel in file.channels:
            known = types.setdefault(channel.topic, [])
            ros_type = ros2_type(channel)
            known.extend([ros_type] if ros_type not in known else [])
            counts[channel.topic] = counts.get(channel.topic, 0) + channel.count
    unplayable = {
        name: f"recorded with the types {', '.join(known)}, allowed: one"
        for name, known in types.items()
        if len(known) > 1
    }
    routes: list[_Routes] = [_converters(file, unplayable) for file in files]
    topics = {
        name: BagTopic(name, known[0], counts[name])
        for name, known in types.items()
        if name not in unplayable
    }
    return topics, unplayable, routes


def _converters(file: StoredFile, unplayable: dict[str, str]) -> dict[int, _Route]:
    """Return the route of each channel that can be played; add the others to `unplayable`."""
    routes = {}
    for channel in file.channels:
        try:
            routes[channel.id] = _Route(channel.topic, converter(channel))
        except InputError as err:
            unplayable.setdefault(channel.topic, str(err))
    return routes


def _routed(path: Path, run: StoredRun, routes: _Routes, start_ns: int) -> Iterator[BagMessage]:
    """Yield a run's messages as those of ROS 2."""
    found: Iterable[StoredMessage] = run.read(routes.keys(), start_ns)
    for log_ns, channel, stored in found:
        topic, convert = routes[channel]
        try:
            payload = convert(stored)
        except InputError as err:
            raise InputError(f"{path}: message of {topic} at {log_ns} ns: {err}") from None
        yield BagMessage(log_ns, topic, payload)
