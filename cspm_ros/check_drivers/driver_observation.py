"""What was heard on a topic: raw messages, what is found about them, and their numbers.

Messages are read leniently: one in another frame, with the right names in another order, or without
a part of its numbers is reported and still read, so that the checks of its numbers can go on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.message import NANOSECONDS, topic_of
from cspm_msgs_py.ros_types import deserialize, serialize
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

LEAST_IN_ORDER = 0.4  # of the messages
_MOST_EXTRA_BYTES = 8  # some serialisers append bytes that no reader looks at
_MOST_NAMES, _MOST_CHARACTERS = 12, 40
_MOST_PROBLEMS = 5


@dataclass(frozen=True)
class Observation:
    """What was heard under one topic name.

    Attributes:
        topic_name: absolute ROS topic name.
        ros_type: type that its publishers announce, several joined by ", ", empty without any.
        publishers: how many there are.
        samples: time of reception [ns] on the clock that the stamps are to be on, and CDR bytes.
    """

    topic_name: str
    ros_type: str
    publishers: int
    samples: Sequence[tuple[int, bytes]] = ()


@dataclass(frozen=True)
class Finding:
    """The outcome of one check.

    Attributes:
        topic: the topic judged.
        check: which check, one word.
        ok: None where the messages cannot decide, or where only a person can.
        text: what was found, and what was expected where it differs.
    """

    topic: str
    check: str
    ok: bool | None
    text: str


@dataclass(frozen=True, eq=False)
class Heard:
    """The messages of one topic that could be read, in order of reception.

    Attributes:
        topic: what the contract says of it.
        receive_ns: shape (n,).
        stamp_ns: shape (n,).
        rows: columns as in `topic.fields`; NaN where a message lacks a number; shape (n, width).
        present: which columns every message that fits carries, shape (width,).
        fits: which messages have the right names, shape (n,); the rows of others are NaN.
    """

    topic: Topic
    receive_ns: Stamps
    stamp_ns: Stamps
    rows: Array
    present: NDArray[np.bool_]
    fits: NDArray[np.bool_]

    @property
    def values(self) -> Array:
        """Rows of the messages that fit, shape (m, width)."""
        return self.rows[self.fits]

    @property
    def value_stamp_ns(self) -> Stamps:
        """Stamps of the messages that fit, shape (m,)."""
        return self.stamp_ns[self.fits]

    @property
    def value_times(self) -> Array:
        """Stamps of the messages that fit, from the first one on, shape (m,) [s]."""
        return seconds(self.value_stamp_ns - self.value_stamp_ns[:1])

    def in_order(self) -> Heard | None:
        """Return only what fits and has a later stamp than all before; None if that is rare."""
        last = np.maximum.accumulate(self.stamp_ns)
        later = self.fits & np.concatenate([[True], self.stamp_ns[1:] > last[:-1]])
        if later.sum() < max(2.0, LEAST_IN_ORDER * len(later)):
            return None
        columns = (self.receive_ns, self.stamp_ns, self.rows)
        receive, stamps, rows = (each[later] for each in columns)
        return Heard(self.topic, receive, stamps, rows, self.present, self.fits[later])

    def part(self, name: str) -> Array | None:
        """Return the columns (m, joints) of a JointState's part; None if it is absent."""
        columns = [i for i, field in enumerate(self.topic.fields) if field.startswith(f"{name}/")]
        if not columns or not self.present[columns].all() or not self.fits.any():
            return None
        return self.values[:, columns]


def seconds(nanoseconds: Stamps) -> Array:
    """Return differences of stamps in seconds."""
    return np.asarray(nanoseconds * 1e-9, dtype=np.float64)


class _Problem(NamedTuple):
    check: str
    text: str


class _Read(NamedTuple):
    """One message: stamp [ns], row, None where the names do not fit, absent parts, problems."""

    stamp_ns: int
    row: Array | None
    absent: frozenset[str]
    problems: list[_Problem]


def hear(topic: Topic, observation: Observation) -> tuple[Heard, list[Finding]]:
    """Read an observation's messages and say where they are not those of `topic`."""
    samples = sorted(observation.samples, key=itemgetter(0))
    n, width = len(samples), topic.width
    stamps, rows = np.zeros(n, dtype=np.int64), np.full((n, width), np.nan)
    read, fits = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    problems: Counter[_Problem] = Counter()
    absent: set[str] = set()
    exact = _read_exact(topic, [payload for _, payload in samples], stamps, rows)
    read[exact] = fits[exact] = True
    for i in np.flatnonzero(~read).tolist():
        try:
            message = _read_one(topic, samples[i][1])
        except InputError as err:
            problems[_Problem("message", str(err).removeprefix(f"{topic.name}: "))] += 1
            continue
        problems.update(message.problems)
        stamps[i], read[i] = message.stamp_ns, True
        if message.row is not None:
            rows[i], fits[i] = message.row, True
            absent |= message.absent
    receive = np.array([received for received, _ in samples], dtype=np.int64)
    present = np.array([field.partition("/")[0] not in absent for field in topic.fields])
    heard = Heard(topic, receive[read], stamps[read], rows[read], present, fits[read])
    return heard, list(_findings(topic, problems, n))


def _read_exact(topic: Topic, payloads: list[bytes], stamps: Stamps, rows: Array) -> list[int]:
    """Read by array operations what has exactly the topic's layout; return which messages."""
    layout = layout_of(topic)
    longest = layout.size + _MOST_EXTRA_BYTES
    fitting = [i for i, p in enumerate(payloads) if layout.size <= len(p) <= longest]
    if not fitting:
        return []
    joined = b"".join(payloads[i][: layout.size] for i in fitting)
    matrix = np.frombuffer(joined, dtype=np.uint8).reshape(len(fitting), layout.size)
    same = layout.matches(matrix)
    exact = [i for i, one in zip(fitting, same.tolist(), strict=True) if one]
    stamps[exact], rows[exact] = layout.decode(matrix[same])
    return exact


def _read_one(topic: Topic, payload: bytes) -> _Read:
    """Read one message whatever its names and frame.

    Raises:
        InputError: it is no message of the type, or holds not one number per name.
    """
    message = deserialize(payload, topic.ros_type)
    found = topic_of(topic.name, message)
    stamp = message.header.stamp
    stamp_ns = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
    problems = list(_frame_problems(topic, found)) + list(_name_problems(topic, found))
    absent = frozenset(topic.parts) - frozenset(found.parts)
    if sorted(found.joint_names) != sorted(topic.joint_names):
        return _Read(stamp_ns, None, absent, problems)
    numbers = dict(zip(found.fields, _numbers(topic, found, message), strict=True))
    row = np.array([numbers.get(field, np.nan) for field in topic.fields])
    return _Read(stamp_ns, row, absent, problems)


def _numbers(topic: Topic, found: Topic, message: Any) -> list[float]:  # noqa: ANN401 - generated
    if topic.parts:
        return [float(value) for part in found.parts for value in getattr(message, part)]
    message.header.frame_id = topic.frame_id
    content = np.frombuffer(serialize(message), dtype=np.uint8)
    numbers: list[float] = layout_of(topic).decode(content[None])[1][0].tolist()
    return numbers


def _frame_problems(topic: Topic, found: Topic) -> Iterator[_Problem]:
    # A JointState's frame has no meaning, whatever its value.
    if topic.frame_id and found.frame_id != topic.frame_id:
        hint = "" if found.frame_id.endswith("_ned") else "; z must point down"
        frame = found.frame_id[:_MOST_CHARACTERS]
        yield _Problem("frame", f"frame {frame!r}, expected {topic.frame_id!r}{hint}")


def _name_problems(topic: Topic, found: Topic) -> Iterator[_Problem]:
    names, expected = found.joint_names, topic.joint_names
    if sorted(names) == sorted(expected):
        if names != expected:
            yield _Problem("names", f"order {_listed(names)}, expected {_listed(expected)}")
    else:
        yield _Problem("names", f"names {_listed(names)}, expected {_listed(expected)}")
    # Parts beyond the contract's are not looked at, here and by the nodes.
    for part in topic.parts:
        if part not in found.parts:
            yield _Problem("parts", f"{part} is empty, expected one number per name")


def _listed(names: Sequence[str]) -> str:
    more = f" … ({len(names)} in all)" if len(names) > _MOST_NAMES else ""
    shown = " ".join(name[:_MOST_CHARACTERS] for name in names[:_MOST_NAMES])
    return (shown or "none") + more


def _findings(topic: Topic, problems: Counter[_Problem], n: int) -> Iterator[Finding]:
    found = problems.most_common(_MOST_PROBLEMS)
    for problem, count in found:
        share = "all messages" if count == n else f"{count} of {n} messages"
        yield Finding(topic.name, problem.check, False, f"{share}: {problem.text}")
    if len(problems) > _MOST_PROBLEMS:
        rest = sum(problems.values()) - sum(count for _, count in found)
        text = f"{len(problems) - _MOST_PROBLEMS} other problems in {rest} messages"
        yield Finding(topic.name, "message", False, text)
    if not problems:
        what = "names as in the test-bed" if topic.joint_names else f"frame {topic.frame_id}"
        yield Finding(topic.name, "message", True, f"{n} of {topic.ros_type}, {what}")
