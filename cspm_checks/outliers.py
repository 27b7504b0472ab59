"""Samples that no machine can have made: single spikes, zeros between, resets, rollovers.

A step counts as impossible beside the steps around it. Nothing is changed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.intp]

AROUND = 25
"""Steps on each side that a step is held against."""
RANK = 5
"""The step around that counts: the fifth largest, so that two spikes more among them hide none."""
FACTOR = 8.0
"""How many times that step is impossible. The fifth largest of 50 steps of white noise is at
1.4 sigma; eight times that, 11 sigma, does not happen. A drive that starts within one sample
makes steps of one size after it, so that the fifth largest is like the first."""
LONGEST_SPIKE = 3
"""Samples after which what comes back is no spike; exact zeros may last as long as `AROUND`."""
LONGEST_ZERO = AROUND
_MOST = 20_000
_ROLLOVER_STEP = 0.5
_CLEAR_STEP = 0.25
_NEAR_END = 4.0
_AGAINST = 0.8
_BACK = 0.2
_GAP = 1.5


@dataclass(frozen=True)
class Outliers:
    """What was found, as places in the samples.

    Attributes:
        spikes: samples that leave and come back.
        zeros: samples that are exactly 0 between others that are far from it.
        jumps: first samples after a step that stays.
        sizes: of those steps, less the usual step there.
        period: what a counter counts to that was not unwrapped; None if the jumps are none.
        period_error: its standard error.
    """

    spikes: Places
    zeros: Places
    jumps: Places
    sizes: Array
    period: float | None = None
    period_error: float = 0.0


def find_outliers(values: Array, stamp_ns: NDArray[np.int64]) -> tuple[Outliers, NDArray[np.intp]]:
    """Return what is impossible in a channel, and the rows that its places count.

    Args:
        values: shape (n,), NaN where there is none.
        stamp_ns: shape (n,).
    """
    rows = np.flatnonzero(~np.isnan(values))
    between = np.diff(stamp_ns[rows])
    usual = np.median(between) if len(between) else 0.0
    whole = (between > 0) & (between <= _GAP * max(usual, 1.0))
    # Stamps that scatter leave no message out.
    if len(whole) and whole.mean() < 0.5:
        whole = np.ones(len(between), dtype=bool)
    return outliers_of(values[rows], whole), rows


def outliers_of(values: Array, whole_steps: NDArray[np.bool_]) -> Outliers:
    """Return what is impossible in a series of samples.

    Args:
        values: without NaN, shape (n,).
        whole_steps: between which samples no message is missing, shape (n - 1,).
    """
    steps = np.where(whole_steps, np.diff(values), 0.0)
    if len(steps) < 2 * RANK:
        return _NONE
    period = _period(values, steps)
    if period is not None:
        jumps = np.flatnonzero(np.abs(steps) > _ROLLOVER_STEP * np.ptp(values))
        return Outliers(_EMPTY, _EMPTY, jumps + 1, steps[jumps], *period)
    places, around = impossible_steps(steps)
    return _sorted_out(values, steps, places, around)


_EMPTY: Places = np.zeros(0, dtype=np.intp)
_NONE = Outliers(_EMPTY, _EMPTY, _EMPTY, np.zeros(0))


def _period(values: Array, steps: Array) -> tuple[float, float] | None:
    """Return the range of a counter that starts again and its error, None if it is none.

    Its steps are small or nearly its range, from one end to the other, and not between.
    """
    span, sizes = float(np.ptp(values)), np.abs(steps)
    large = sizes > _ROLLOVER_STEP * span
    between = (sizes > _CLEAR_STEP * span) & ~large
    at = np.flatnonzero(large)
    if not len(at) or between.any() or len(at) > _CLEAR_STEP * len(steps):
        return None
    usual = _steps_beside(np.where(large, 0.0, steps), at)
    periods = np.abs(steps[at] - usual)
    period = float(np.median(periods))
    slack = _NEAR_END * np.maximum(np.abs(usual), np.median(sizes[~large]))
    upper, lower = np.maximum(values[at], values[at + 1]), np.minimum(values[at], values[at + 1])
    at_ends = (upper >= values.max() - slack) & (lower <= values.min() + slack)
    same = np.abs(periods - period) <= slack
    # The motion goes on, so that the step is against it.
    against = np.mean(np.sign(usual) == -np.sign(steps[at])) > _AGAINST
    if not (at_ends.all() and same.all() and against):
        return None
    # With one step only, its size is as uncertain as the step beside it.
    scatter = periods.std() if len(periods) > 2 else np.abs(usual).max()
    return period, float(scatter / np.sqrt(len(periods)))


def _steps_beside(steps: Array, at: Places) -> Array:
    """Return the mean of the steps before and after some steps, those that are 0 left out."""
    pair = np.stack([steps[np.maximum(at - 1, 0)], steps[np.minimum(at + 1, len(steps) - 1)]])
    return np.asarray(pair.sum(axis=0) / np.maximum((pair != 0.0).sum(axis=0), 1))


def impossible_steps(steps: Array) -> tuple[Places, Array]:
    """Return the places of impossible steps, and the usual size of the steps around each."""
    sizes = np.abs(steps)
    moving = sizes[sizes > 0]
    if not len(moving):
        return _EMPTY, np.zeros(0)
    finest = float(moving.min())
    candidates = np.flatnonzero(sizes > FACTOR * max(float(np.median(sizes)), finest))
    if len(candidates) > _MOST:
        candidates = np.sort(candidates[np.argsort(sizes[candidates])[-_MOST:]])
    padded = np.pad(sizes, AROUND)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)[candidates]
    # The step itself is among them, and the largest if it is impossible.
    usual = np.partition(windows, -RANK - 1, axis=1)[:, -RANK - 1]
    hit = sizes[candidates] > FACTOR * np.maximum(usual, finest)
    return candidates[hit], usual[hit]


def _sorted_out(values: Array, steps: Array, places: Places, around: Array) -> Outliers:
    spikes: list[int] = []
    zeros: list[int] = []
    jumps: list[int] = []
    i = 0
    while i < len(places):
        start = int(places[i])
        end = _comes_back(steps, places, around, i, values)
        if end is None:
            jumps.append(start + 1)
            i += 1
            continue
        run = range(start + 1, int(places[end]) + 1)
        if not values[start + 1 : run.stop].any():
            zeros += run
        else:
            spikes += run
        i = end + 1
    spikes, jumps = _at_the_ends(spikes, jumps, len(values))
    at = np.array(jumps, dtype=np.intp)
    last = len(steps) - 1
    usual = (steps[np.maximum(at - 2, 0)] + steps[np.minimum(at, last)]) / 2
    return Outliers(
        np.array(spikes, dtype=np.intp),
        np.array(zeros, dtype=np.intp),
        at,
        steps[at - 1] - usual,
    )


def _comes_back(
    steps: Array, places: Places, around: Array, first: int, values: Array
) -> int | None:
    """Return which later impossible step brings the values back, None if none does."""
    start = int(places[first])
    for later in range(first + 1, len(places)):
        length = int(places[later]) - start
        zeros = not values[start + 1 : start + length + 1].any()
        if length > (LONGEST_ZERO if zeros else LONGEST_SPIKE):
            return None
        apart = abs(values[int(places[later]) + 1] - values[start])
        usual = FACTOR * (length + 1) * max(around[first], around[later])
        if apart <= usual + _BACK * abs(steps[start]):
            return later
    return None


def _at_the_ends(spikes: list[int], jumps: list[int], count: int) -> tuple[list[int], list[int]]:
    """Take what was before the first jump, or after the last, for spikes if it is that short."""
    kept = list(jumps)
    if kept and kept[0] <= LONGEST_SPIKE:
        spikes = [*range(kept.pop(0)), *spikes]
    if kept and count - kept[-1] <= LONGEST_SPIKE:
        spikes = [*spikes, *range(kept.pop(), count)]
    return spikes, kept
