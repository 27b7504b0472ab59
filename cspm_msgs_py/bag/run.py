"""Runs of messages: pieces of a bag that are read one after the other, merged by log time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush, heapreplace
from pathlib import Path
from typing import NamedTuple, Protocol


class BagMessage(NamedTuple):
    """One message of a bag.

    Attributes:
        log_ns: when it was recorded [ns].
        topic: its topic's name.
        payload: the message as little-endian CDR of ROS 2.
    """

    log_ns: int
    topic: str
    payload: bytes


StoredMessage = tuple[int, int, bytes]
"""Log time [ns], channel id and payload of a message as the file holds them."""


@dataclass(frozen=True)
class StoredChannel:
    """What one file says about one sender of a topic.

    Attributes:
        id: its number in the file.
        topic: topic name.
        ros_type: name of the type as the file has it.
        count: number of messages.
        encoding: of the messages: `cdr` or `ros1`, or another that cannot be played.
        schema_encoding: of the definition, empty where the file holds none.
        definition: text of the type's definition with those of nested types.
        sample: a stored message, where the file holds no definition to judge the type by.
    """

    id: int
    topic: str
    ros_type: str
    count: int
    encoding: str
    schema_encoding: str
    definition: str
    sample: bytes | None = None


class StoredRun(NamedTuple):
    """A piece of a file that is read at once or row by row.

    Attributes:
        first_ns: earliest log time in it [ns].
        last_ns: latest log time in it [ns].
        read: yields the messages of some channels that are not earlier than an instant [ns], in
            order of log time, those of one log time as they stand in the file.
    """

    first_ns: int
    last_ns: int
    read: Callable[[Collection[int], int], Iterator[StoredMessage]]


class StoredFile(Protocol):
    """One file of a bag, open.

    Attributes:
        path: the file.
        channels: in the file's order.
        runs: in the order in which they stand in the file.
        faults: why it is not whole, one line each: not closed, parts that cannot be read.
    """

    path: Path
    channels: list[StoredChannel]
    runs: list[StoredRun]
    faults: list[str]

    def close(self) -> None:
        """Close the file."""


class Run(NamedTuple):
    """A run with its choice of messages made: its first and last log time [ns], and how to begin.

    `begin` yields its messages in order of log time.
    """

    first_ns: int
    last_ns: int
    begin: Callable[[], Iterator[BagMessage]]


class _Head(NamedTuple):
    """The next message of a run that was begun; compares by log time, then by the run's place."""

    log_ns: int
    place: int
    message: BagMessage
    rest: Iterator[BagMessage]


def in_order(runs: Sequence[Run]) -> Iterator[BagMessage]:
    """Yield the messages of all runs in order of log time.

    Messages of one log time come in the order of their runs, those of one run as it yields them. A
    run is begun only when its first log time is reached, so that only runs that overlap are held at
    the same time.
    """
    places = sorted(range(len(runs)), key=lambda place: (runs[place].first_ns, place))
    waiting = deque(places)
    heads: list[_Head] = []
    while waiting or heads:
        while waiting and (not heads or runs[waiting[0]].first_ns <= heads[0].log_ns):
            place = waiting.popleft()
            _advance(heads, place, runs[place].begin())
        if not heads:
            continue
        if len(heads) == 1 and (not waiting or _ends_before(runs, heads[0].place, waiting[0])):
            head = heads.pop()
            yield head.message
            yield from head.rest
            continue
        head = heads[0]
        yield head.message
        following = next(head.rest, None)
        if following is None:
            heappop(heads)
        else:
            heapreplace(heads, head._replace(log_ns=following.log_ns, message=following))


def _advance(heads: list[_Head], place: int, rest: Iterator[BagMessage]) -> None:
    """Put a run that was just begun to the others, unless it has no message."""
    first = next(rest, None)
    if first is not None:
        heappush(heads, _Head(first.log_ns, place, first, rest))


def _ends_before(runs: Sequence[Run], place: int, other: int) -> bool:
    """Return whether every message of a run comes before every message of another."""
    return (runs[place].last_ns, place) < (runs[other].first_ns, other)
