"""The samples of one sensor at its own rate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A hole is where samples lie farther apart than this many usual intervals.
HOLE = 5.5


@dataclass(frozen=True, eq=False)
class Samples:
    """Values of one sensor.

    Attributes:
        times: when each is valid [s] after the recording's start, increasing, shape (n,).
        values: shape (n, width).
    """

    times: Array
    values: Array

    @property
    def interval(self) -> float:
        """The usual time between two samples [s], their median; 0 with fewer than two."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else 0.0

    @property
    def rate(self) -> float:
        """Samples per second; 0 with fewer than two."""
        return 1.0 / self.interval if self.interval > 0 else 0.0

    @property
    def spans(self) -> list[slice]:
        """The stretches without a hole, as slices of the samples."""
        holes = np.flatnonzero(np.diff(self.times) > HOLE * self.interval) + 1
        edges = [0, *holes.tolist(), len(self.times)]
        return [slice(a, b) for a, b in pairwise(edges)]

    def column(self, index: int) -> Samples:
        """Return one column, shape (n, 1)."""
        return Samples(self.times, self.values[:, index : index + 1])

    def shifted(self, seconds: float) -> Samples:
        """Return the same values, valid `seconds` later."""
        return Samples(self.times + seconds, self.values)

    def within(self, start: float, end: float) -> Samples:
        """Return the samples from `start` to `end` [s], both included."""
        inside = (self.times >= start) & (self.times <= end)
        return Samples(self.times[inside], self.values[inside])


def ordered(times: Array, values: Array) -> Samples:
    """Return samples in order of time; of equal times the first, and only rows that are finite."""
    whole = np.isfinite(values).all(axis=1)
    order = np.argsort(times[whole], kind="stable")
    t, v = times[whole][order], values[whole][order]
    new = np.concatenate([[True], np.diff(t) > 0]) if len(t) else np.zeros(0, dtype=bool)
    return Samples(t[new], v[new])


def stretches(values: Array, length: int, most: int) -> Array:
    """Return a long record, (n, …), as `most` stretches of `length` rows, spread evenly and joined.

    A record that has no more of them is returned as it is.
    """
    count = len(values) // max(1, length)
    if count <= most:
        return values
    chosen = np.linspace(0, count - 1, most).round().astype(int)
    parts = values[: count * length].reshape(count, length, *values.shape[1:])
    return np.asarray(parts[chosen].reshape(most * length, *values.shape[1:]))
