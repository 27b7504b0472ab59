"""The samples of one sensor at its own rate."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Made = TypeVar("Made")

# A hole is where samples lie farther apart than this many usual intervals.
HOLE = 5.5
# Of the usual interval: readings farther apart have lost one between them.
_GAP = 1.5
# Fewer samples determine no clock.
_FEWEST = 16
_DRIFT_ORDER = 3
# Of the interval: stamps that scatter more are no even clock's.
_SCATTER = 0.3
_EXACT = 1e-6


@dataclass(frozen=True, eq=False)
class Stamps:
    """Times of samples, and what follows from these alone.

    Attributes:
        times: increasing, shape (n,) [s]; not to be written to.
        shared: what others made of these times, for all values that have them.
    """

    times: Array
    shared: dict[Hashable, Array] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def interval(self) -> float:
        """The usual time between two samples [s], their median; 0 with fewer than two."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else 0.0

    @cached_property
    def gaps(self) -> NDArray[np.bool_]:
        """After which samples, but the last, one has been lost, (n - 1,)."""
        return np.asarray(np.diff(self.times) > _GAP * self.interval)

    @cached_property
    def spans(self) -> list[slice]:
        """The stretches without a hole, as slices of the samples."""
        holes = np.flatnonzero(np.diff(self.times) > HOLE * self.interval) + 1
        edges = [0, *holes.tolist(), len(self.times)]
        return [slice(a, b) for a, b in pairwise(edges)]

    @cached_property
    def clocks(self) -> list[tuple[Array, Array]]:
        """Of each stretch the stamps without their scatter, and its samples' numbers by the clock.

        Where stamps follow no even clock, they themselves are returned, and numbers in between.
        """
        return [_clocked(self.times[span]) for span in self.spans]

    @cached_property
    def even(self) -> Stamps:
        """The stamps without their scatter."""
        return Stamps(np.concatenate([times for times, _ in self.clocks]))


@dataclass(frozen=True, eq=False)
class Samples:
    """Values of one sensor.

    Attributes:
        times: when each is valid [s] after the recording's start, increasing, shape (n,); not to be
            written to.
        values: shape (n, width); not to be written to.
        stamps: the same times, where what follows from them is shared with other values; made if
            not given.

    Raises:
        ValueError: the stamps are of other times.
    """

    times: Array
    values: Array
    stamps: Stamps | None = field(default=None, repr=False)
    _kept: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse stamps of other times."""
        if self.stamps is not None and self.stamps.times is not self.times:
            raise ValueError("stamps of other times")

    @cached_property
    def _stamps(self) -> Stamps:
        return Stamps(self.times) if self.stamps is None else self.stamps

    @property
    def shared(self) -> dict[Hashable, Array]:
        """What others made of the times alone, for all values that have them."""
        return self._stamps.shared

    @property
    def interval(self) -> float:
        """The usual time between two samples [s], their median; 0 with fewer than two."""
        return self._stamps.interval

    @property
    def rate(self) -> float:
        """Samples per second; 0 with fewer than two."""
        return 1.0 / self.interval if self.interval > 0 else 0.0

    @property
    def gaps(self) -> NDArray[np.bool_]:
        """After which samples, but the last, one has been lost, (n - 1,)."""
        return self._stamps.gaps

    @property
    def spans(self) -> list[slice]:
        """The stretches without a hole, as slices of the samples."""
        return self._stamps.spans

    @property
    def clocks(self) -> list[tuple[Array, Array]]:
        """Of each stretch the stamps without their scatter, and its samples' numbers by the clock.

        Where stamps follow no even clock, they themselves are returned, and numbers in between.
        """
        return self._stamps.clocks

    @property
    def even(self) -> Samples:
        """The same values at stamps without their scatter."""
        stamps = self._stamps.even
        return Samples(stamps.times, self.values, stamps)

    def column(self, index: int) -> Samples:
        """Return one column, shape (n, 1)."""
        return self.kept(index, lambda: self.of_others(self.values[:, index : index + 1]))

    def kept(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return what `make` returned at the first call with a key; it lives as long as these.

        Equations of one recording are written again for each machine that it is held against: what
        follows from the readings alone is then there.
        """
        if key not in self._kept:
            self._kept[key] = make()
        made: Made = self._kept[key]
        return made

    def of_others(self, values: Array) -> Samples:
        """Return other values, shape (n, any), at the same times."""
        return Samples(self.times, values, self._stamps)

    def shifted(self, seconds: float) -> Samples:
        """Return the same values, valid `seconds` later."""
        return Samples(self.times + seconds, self.values)

    def within(self, start: float, end: float) -> Samples:
        """Return the samples from `start` to `end` [s], both included; themselves if all are."""
        first = np.searchsorted(self.times, start)
        last = np.searchsorted(self.times, end, side="right")
        if first == 0 and last == len(self.times):
            return self
        return Samples(self.times[first:last], self.values[first:last])

    def since(self, start: float) -> Samples:
        """Return the samples from `start` [s] on; the same object at every call."""
        return self.kept((Samples.since, start), lambda: self.within(start, np.inf))

    def without(self, start: float, end: float) -> Samples:
        """Return the samples before `start` and after `end` [s], which leaves a hole."""
        outside = (self.times < start) | (self.times > end)
        return Samples(self.times[outside], self.values[outside])


def digest(times: Array) -> bytes:
    """Return a digest of times (k,), for keys: these are kept, and with them all that they hold."""
    return sha256(times.tobytes()).digest()


def _clocked(times: Array) -> tuple[Array, Array]:
    if len(times) < _FEWEST:
        return times, np.arange(float(len(times)))
    interval = float(np.median(np.diff(times)))
    place = np.concatenate([[0], np.cumsum(np.maximum(1, np.round(np.diff(times) / interval)))])
    # Rates drift: a clock is a straight line over some seconds only.
    line = np.polynomial.Chebyshev.fit(place, times, _DRIFT_ORDER)(place)
    scatter = np.abs(times - line).max() / interval
    if scatter > _SCATTER:
        return times, (times - times[0]) / interval
    return np.asarray(line if scatter > _EXACT else times), place


def ordered(times: Array, values: Array) -> Samples:
    """Return samples in order of time; of equal times the first, and only rows that are finite."""
    whole = np.isfinite(values).all(axis=1)
    if whole.all() and (np.diff(times) > 0).all():
        return Samples(times, values)
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
