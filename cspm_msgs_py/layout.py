"""Fixed places of the numbers in a topic's CDR bytes, so that blocks convert by array operations.

Once names and frame are fixed, every message of a contract topic except `/diagnostics` has the
same bytes but for its stamp and its numbers. Where those stand is found by serialising a message
of marked values and searching for the marks: the serialiser alone knows the rules of alignment.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS, message_of
from cspm_msgs_py.ros_types import deserialize, serialize
from cspm_msgs_py.topics import Topic

Bytes = NDArray[np.uint8]
Stamps = NDArray[np.int64]
Rows = NDArray[np.float64]

_MARK_SECONDS, _MARK_NANOSECONDS = 0x5AC3_71E9, 0x2F1B_96D5
LATEST_SECOND = 2**31 - 1


@dataclass(frozen=True, eq=False)
class Layout:
    """Where stamp and numbers of a topic's messages stand.

    Attributes:
        topic: the topic.
        template: the bytes of the message with stamp and numbers zero, shape (size,).
        seconds: offset of the stamp's seconds; its nanoseconds follow.
        runs: offset and number of columns of each unbroken run of numbers, in column order.
    """

    topic: Topic
    template: Bytes
    seconds: int
    runs: tuple[tuple[int, int], ...]

    @property
    def size(self) -> int:
        """Length of every message [bytes]."""
        return len(self.template)

    @cached_property
    def columns(self) -> list[slice]:
        """Columns of the row that each run holds."""
        ends = np.cumsum([0] + [count for _, count in self.runs]).tolist()
        return [slice(ends[i], ends[i + 1]) for i in range(len(self.runs))]

    @cached_property
    def halves(self) -> NDArray[np.int64]:
        """Where each number begins, (width,), counted in 4 bytes: CDR aligns to these at least."""
        places = [first // 4 + 2 * i for first, count in self.runs for i in range(count)]
        return np.array(places, dtype=np.int64)

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """Structure of a message: sec, nanosec, run0, run1, …; all else is constant."""
        names = ["sec", "nanosec"] + [f"run{i}" for i in range(len(self.runs))]
        formats = ["<i4", "<u4"] + [f"({count},)<f8" for _, count in self.runs]
        offsets = [self.seconds, self.seconds + 4] + [offset for offset, _ in self.runs]
        return np.dtype(
            {"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size}
        )

    def fill(self, records: NDArray[np.void], stamp_ns: Stamps, rows: Rows) -> None:
        """Write stamps, shape (n,), and rows, shape (n, width), into records with `dtype`'s fields.

        Raises:
            InputError: a stamp is outside what a ROS stamp can hold.
        """
        records["sec"], records["nanosec"] = split_stamps(stamp_ns, lambda _: self.topic.name)
        for i, columns in enumerate(self.columns):
            records[f"run{i}"] = rows[:, columns]

    def encode(self, stamp_ns: ArrayLike, rows: ArrayLike) -> Bytes:
        """Return the messages' CDR bytes, shape (n, size).

        Args:
            stamp_ns: shape (n,) [ns].
            rows: shape (n, width).

        Raises:
            InputError: shapes that do not fit, or a stamp outside what a ROS stamp can hold.
        """
        stamps = np.asarray(stamp_ns, dtype=np.int64)
        numbers = np.asarray(rows, dtype=np.float64)
        if stamps.ndim != 1 or numbers.shape != (len(stamps), self.topic.width):
            raise InputError(
                f"{self.topic.name}: {stamps.shape} stamps and {numbers.shape} rows, allowed:"
                f" (n,) and (n, {self.topic.width})"
            )
        out = np.repeat(self.template[None], len(stamps), axis=0)
        if len(stamps):
            self.fill(out.view(self.dtype)[:, 0], stamps, numbers)
        return out

    def decode(self, payload: Bytes) -> tuple[Stamps, Rows]:
        """Return stamps [ns], shape (n,), and rows, shape (n, width), of CDR bytes (n, size).

        Bytes outside stamp and numbers are not looked at, see `matches`.
        """
        records = np.ascontiguousarray(payload).view(self.dtype)[:, 0]
        stamps = records["sec"].astype(np.int64) * NANOSECONDS + records["nanosec"]
        rows = np.empty((len(records), self.topic.width))
        for i, columns in enumerate(self.columns):
            rows[:, columns] = records[f"run{i}"]
        return stamps, rows

    @cached_property
    def constant(self) -> NDArray[np.intp]:
        """Offsets that hold neither stamp nor number nor padding, ascending.

        Padding is what a reader does not look at: the message read is the same whatever is
        there. Some serialisers leave it uninitialised; the template's is zero.
        """
        free = np.zeros(self.size, dtype=bool)
        free[self.seconds : self.seconds + 8] = True
        for offset, count in self.runs:
            free[offset : offset + 8 * count] = True
        template = self.template.tobytes()
        for offset in np.flatnonzero(~free & (self.template == 0)).tolist():
            changed = bytearray(template)
            changed[offset] ^= 0xFF
            try:
                message = deserialize(bytes(changed), self.topic.ros_type)
            except InputError:
                continue
            free[offset] = serialize(message) == template
        return np.flatnonzero(~free)

    def matches(self, payload: Bytes) -> NDArray[np.bool_]:
        """Return which of the CDR bytes, shape (n, size), are this topic's message, shape (n,)."""
        same = payload[:, self.constant] == self.template[self.constant]
        return np.asarray(same.all(axis=1))


def split_stamps(stamp_ns: Stamps, name: Callable[[int], str]) -> tuple[Stamps, Stamps]:
    """Return seconds and nanoseconds of stamps [ns], all of shape (n,).

    Args:
        stamp_ns: the stamps.
        name: of the topic of the message at an index.

    Raises:
        InputError: a stamp is outside what a ROS stamp can hold.
    """
    seconds, nanoseconds = np.divmod(stamp_ns, NANOSECONDS)
    if len(seconds) and not -LATEST_SECOND - 1 <= seconds.min() <= seconds.max() <= LATEST_SECOND:
        worst = int(np.argmax(np.abs(seconds)))
        raise InputError(
            f"{name(worst)}: stamp {stamp_ns[worst]} ns, allowed: ±{LATEST_SECOND} s"
            " (int32 seconds)"
        )
    return seconds, nanoseconds


@cache
def layout_of(topic: Topic) -> Layout:
    """Return the layout of a topic's messages, found once and kept for the process's life.

    Raises:
        InputError: the topic's type carries no row, or its columns do not fit its names.
    """
    return find_layout(topic)


def find_layout(topic: Topic) -> Layout:
    """Return the layout of a topic's messages without keeping it.

    For topics that others make up, of which there is no end.

    Raises:
        InputError: as `layout_of`.
    """
    _check_columns(topic)
    marks = np.ldexp(np.arange(1, topic.width + 1) * 1.23456789e5 + 0.987654321, -7)
    stamp = _MARK_SECONDS * NANOSECONDS + _MARK_NANOSECONDS
    marked = serialize(message_of(topic, stamp, marks))
    seconds = _find(marked, struct.pack("<iI", _MARK_SECONDS, _MARK_NANOSECONDS), topic)
    places = [_find(marked, mark.tobytes(), topic) for mark in marks]
    template = serialize(message_of(topic, 0, np.zeros(topic.width)))
    return Layout(topic, np.frombuffer(template, dtype=np.uint8), seconds, _runs(places))


def _check_columns(topic: Topic) -> None:
    expected = len(topic.parts) * len(topic.joint_names)
    if topic.ros_type == "sensor_msgs/msg/JointState" and topic.width != expected:
        raise InputError(
            f"{topic.name}: {topic.width} columns for {len(topic.parts)} parts of"
            f" {len(topic.joint_names)} joints, allowed: {expected}"
        )


def _find(content: bytes, mark: bytes, topic: Topic) -> int:
    if content.count(mark) != 1:
        raise InputError(f"{topic.name}: {topic.ros_type} does not hold its row once")
    return content.index(mark)


def _runs(places: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Return offset and length of each stretch of float64 that stand side by side."""
    runs = groupby(enumerate(places), key=lambda item: item[1] - 8 * item[0])
    return tuple((group[0][1], len(group)) for group in (list(items) for _, items in runs))
