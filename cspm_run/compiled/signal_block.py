"""The signals of a stretch of steps, a row per step, and which of them were sent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.phase import Slots
from cspm_run.compiled.sent_kernel import COLUMNS, FIRST, SENDER, WIDTH, gather

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]
Words = NDArray[np.int64]


class Sent(NamedTuple):
    """The messages of a block, topic after topic; views that the next block overwrites.

    Attributes:
        counts: messages of each topic, (topics,).
        steps: of their arrival, (n,).
        numbers: their rows, one after another.
    """

    counts: Words
    steps: Words
    numbers: Array


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
        self._slots = slots
        self._index = {topic: i for i, topic in enumerate(topics)}
        self.rows = np.zeros((1 + steps, slots.width))
        self.done: Flags = np.zeros((steps, jobs), dtype=np.uint8)
        self._by_python: Flags = np.zeros((steps, len(topics)), dtype=np.uint8)
        self._topics = np.zeros((len(topics), COLUMNS), dtype=np.int64)
        for row, (topic, job) in zip(self._topics, topics.items(), strict=True):
            columns = slots[topic]
            row[SENDER], row[FIRST] = job, columns.start
            row[WIDTH] = columns.stop - columns.start
        self._counts = np.zeros(len(topics), dtype=np.int64)
        self._found = np.zeros(len(topics) * steps, dtype=np.int64)
        self._numbers = np.zeros(int(self._topics[:, WIDTH].sum()) * steps)
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

    def sent(self, steps: int) -> Sent:
        """Return the messages of the first `steps` steps."""
        flags, out = (self.done, self._by_python), (self._counts, self._found, self._numbers)
        gather(self.rows, *flags, self._topics, steps, *out)
        messages = int(self._counts.sum())
        numbers = int(self._counts @ self._topics[:, WIDTH])
        return Sent(self._counts, self.begin + self._found[:messages], self._numbers[:numbers])
