"""A bag being streamed: ROS 2 messages in the order in which they were logged, whoever wrote it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cspm_msgs_py.bag.conversion import Convert, converter, ros2_type
from cspm_msgs_py.bag.files import open_files
from cspm_msgs_py.bag.own_types import OwnType, own_type
from cspm_msgs_py.bag.run import (
    BagMessage,
    Run,
    StoredChannel,
    StoredFile,
    StoredMessage,
    StoredRun,
    in_order,
)
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.closing import Closing
from cspm_msgs_py.ros_types import deserialize, typestore

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

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

    def __init__(self, path: Path, *, own_types: bool = False, tolerant: bool = False) -> None:
        """Open a bag; see `open_bag`.

        Raises:
            InputError: see `open_bag`.
        """
        self.path = path
        self._stack = ExitStack()
        try:
            self._files, self._faults = open_files(path, self._stack, tolerant=tolerant)
            runs = [run for file in self._files for run in file.runs]
            if not runs:
                raise InputError(f"{path}: holds no message")
            self.start_ns = min(run.first_ns for run in runs)
            self.end_ns = max(run.last_ns for run in runs)
            plan = _plan(self._files, own_types=own_types)
            self.topics, self.unplayable, self._routes, self._own = plan
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

    @property
    def faults(self) -> list[str]:
        """What is missing or damaged, one line each, as far as the bag was read."""
        return [*self._faults, *(fault for file in self._files for fault in file.faults)]

    def message(self, topic: str, payload: bytes) -> Any:  # noqa: ANN401 - made at run time
        """Return the message that a payload of the stream holds.

        Raises:
            InputError: it does not hold its type.
        """
        return deserialize(payload, self.topics[topic].ros_type, self.store(topic))

    def store(self, topic: str) -> Typestore:
        """Return the definitions by which a topic's messages are read."""
        return self._own[topic].store if topic in self._own else typestore()

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


def open_bag(path: Path, *, own_types: bool = False, tolerant: bool = False) -> BagStream:
    """Open a bag for streaming.

    Read are rosbag2 folders and their single `.mcap` and `.db3` files, among them this project's
    recordings, closed or cut short, and ROS 1 bags.

    Args:
        path: a folder or file.
        own_types: also read types that ROS 2 Jazzy has not, or has otherwise, by the definitions in
            the bag; `BagStream.message` reads them.
        tolerant: leave out chunks of MCAP files that cannot be read; `BagStream.faults` says which.

    Raises:
        InputError: it is missing, not a bag, damaged, stored in an unknown way, or without message.
    """
    return BagStream(Path(path), own_types=own_types, tolerant=tolerant)


class _Route(NamedTuple):
    """Where the messages of a stored channel go: the topic, and what converts them."""

    topic: str
    convert: Convert


_Routes = Mapping[int, _Route]


class _Plan(NamedTuple):
    """Topics, reasons against reading the others, routes by file, and own types by topic."""

    topics: dict[str, BagTopic]
    unplayable: dict[str, str]
    routes: list[_Routes]
    own: dict[str, OwnType]


def _plan(files: Sequence[StoredFile], *, own_types: bool) -> _Plan:
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
    own = _OwnTypes() if own_types else None
    routes: list[_Routes] = [_converters(file, unplayable, own) for file in files]
    topics = {
        name: BagTopic(name, known[0], counts[name])
        for name, known in types.items()
        if name not in unplayable
    }
    return _Plan(topics, unplayable, routes, own.types if own else {})


class _OwnTypes:
    """What is read by the bag's own definitions, by topic."""

    def __init__(self) -> None:
        self.types: dict[str, OwnType] = {}
        self._known: dict[str, tuple[str, str]] = {}

    def route(self, channel: StoredChannel) -> _Route:
        """Return the route of a channel's messages.

        Raises:
            InputError: its definition is missing, cannot be read, or is not that of another sender.
        """
        said = (channel.encoding, channel.definition)
        if self._known.setdefault(channel.topic, said) != said:
            raise InputError("recorded with two definitions of its type, allowed: one")
        if channel.topic not in self.types:
            self.types[channel.topic] = own_type(channel, ros2_type(channel))
        return _Route(channel.topic, self.types[channel.topic].convert)


def _converters(
    file: StoredFile, unplayable: dict[str, str], own: _OwnTypes | None
) -> dict[int, _Route]:
    """Return the route of each channel that can be read; add the others to `unplayable`."""
    routes = {}
    for channel in file.channels:
        try:
            routes[channel.id] = _route(channel, own)
        except InputError as err:
            unplayable.setdefault(channel.topic, str(err))
    return routes


def _route(channel: StoredChannel, own: _OwnTypes | None) -> _Route:
    try:
        return _Route(channel.topic, converter(channel))
    except InputError:
        known = ros2_type(channel) in typestore().fielddefs
        if own is None or (known and not channel.definition):
            raise
        return own.route(channel)


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
