"""The signals of a stretch of steps, a row per step, and which of them were sent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.phase import Slots

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]


class SentRows(NamedTuple):
    """A topic's messages of a block: steps of arrival (n,), and rows (n, width)."""

    topic: str
    steps: NDArray[np.int64]
    rows: Array


class RowView(Mapping[str, Array]):
    """The latest row of each topic at a step, as a stage in Python reads them: copies."""

    def __init__(self, row: Array, slots: Slots, topics: tuple[str, ...]) -> None:
        """Take the signals (width,), where they are, and the topics to be seen."""
        self._row, self._slots, self._topics = row, slots, topics

    def __getitem__(self, topic: str) -> Array:
        if topic not in self._topics:
            raise KeyError(topic)
        values: Array = self._row[self._slots[topic]]
        return values.copy()

    def __iter__(self) -> Iterator[str]:
        return iter(self._topics)

    def __len__(self) -> int:
        return len(self._topics)


class SignalBlock:
    """Rows of signals for up to `steps` steps.

    Attributes:
        rows: (1 + steps, width); the first row is that of the step before.
        done: which jobs compiled code did, (steps, jobs).
        begin: step of the second row.
    """

    def __init__(self, slots: Slots, steps: int, jobs: int, topics: Mapping[str, int]) -> None:
        """Make room; `topics` are those that are kept, with the job that sends each."""
        self._slots, self._topics = slots, topics
        self._index = {topic: i for i, topic in enumerate(topics)}
        self.rows = np.zeros((1 + steps, slots.width))
        self.done: Flags = np.zeros((steps, jobs), dtype=np.uint8)
        self._by_python: Flags = np.zeros((steps, len(topics)), dtype=np.uint8)
        self.begin = 0

    def start(self, step: int, last: Array) -> None:
        """Begin at a step, after the row (width,) of the step before."""
        self.begin = step
        self.rows[0] = last
        self.done[:] = 0
        self._by_python[:] = 0

    def row(self, step: int) -> Array:
        """Return the signals (width,) at a step; a view."""
        row: Array = self.rows[step - self.begin + 1]
        return row

    def send(self, step: int, topic: str, values: Array) -> None:
        """Take a row that Python sends at a step."""
        self.row(step)[self._slots[topic]] = values
        if topic in self._index:
            self._by_python[step - self.begin, self._index[topic]] = 1

    def sent(self, steps: int) -> Iterator[SentRows]:
        """Yield the messages of each topic of the first `steps` steps."""
        for i, (topic, job) in enumerate(self._topics.items()):
            flags = self.done[:steps, job] | self._by_python[:steps, i]
            found = np.flatnonzero(flags)
            if len(found):
                columns = self._slots[topic]
                yield SentRows(topic, self.begin + found, self.rows[1 + found, columns])
