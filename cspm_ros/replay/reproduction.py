"""Reproduced messages held against the recorded ones, bit for bit, as both come."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.difference import Difference
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]


class Deviation(NamedTuple):
    """By how much a field differs at most, in the field's unit."""

    size: float
    field: str


class Reproduction:
    """One topic's messages.

    Attributes:
        compared: number of messages that came and were compared.
        different: number of those that differ in any bit.
        first: the first difference, None if there is none.
        largest: the largest difference of a number.
    """

    def __init__(self, topic: Topic) -> None:
        self._topic = topic
        self._recorded: deque[tuple[int, Array]] = deque()
        self.compared = 0
        self.different = 0
        self.first: Difference | None = None
        self.largest = Deviation(0.0, "")

    @property
    def identical(self) -> bool:
        """Whether nothing differs."""
        return self.first is None

    def expect(self, stamp_ns: int, row: Array) -> None:
        """Take the next recorded message: stamp [ns] and row, shape (width,)."""
        self._recorded.append((stamp_ns, row))

    def take(self, stamp_ns: int, row: Array) -> None:
        """Compare the next reproduced message.

        Raises:
            InputError: none was recorded that it could be.
        """
        if not self._recorded:
            raise InputError(
                f"{self._topic.name}: a message of {stamp_ns * 1e-9:.6f} s, allowed: those recorded"
            )
        recorded_stamp, recorded = self._recorded.popleft()
        if recorded_stamp != stamp_ns:
            self._note(recorded_stamp, "stamp", recorded_stamp, stamp_ns)
        elif recorded.tobytes() != row.tobytes():
            self._compare(stamp_ns, recorded, row)
        self.compared += 1

    def _compare(self, stamp_ns: int, recorded: Array, row: Array) -> None:
        unequal = np.flatnonzero(recorded.view(np.int64) != row.view(np.int64))
        fields, column = self._topic.fields, int(unequal[0])
        self._note(stamp_ns, fields[column], float(recorded[column]), float(row[column]))
        deviations = np.abs(row - recorded)
        worst = int(np.argmax(deviations))
        if deviations[worst] > self.largest.size:
            self.largest = Deviation(float(deviations[worst]), fields[worst])

    def _note(self, stamp_ns: int, field: str, recorded: object, reproduced: object) -> None:
        self.different += 1
        if self.first is None:
            self.first = Difference(
                self._topic.name, self.compared, stamp_ns, field, recorded, reproduced
            )

    def __str__(self) -> str:
        if self.first is None:
            return f"{self._topic.name}: {self.compared} messages, identical bit for bit"
        size = f", by at most {self.largest.size:.3g} ({self.largest.field})"
        return (
            f"{self._topic.name}: {self.different} of {self.compared} messages differ"
            f"{size if self.largest.size else ''}; first: {self.first}"
        )
