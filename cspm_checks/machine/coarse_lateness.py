"""How late channels are against those that they must follow, up to the length of a recording.

Both are brought to a common step and correlated at every shift, by the fast Fourier transform, each
shift over what it leaves in common. This finds seconds; `lateness` then finds parts of a sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import correlate

Array = NDArray[np.float64]
MOST_STEPS = 20_000
SURE = 0.95
"""Correlation at the best shift: poses and winches reach 0.99, torque and tension with friction
0.96; what moves otherwise stays below 0.8."""
GAIN = 0.1
"""What the best shift has to correlate more than none at all."""
OPPOSITE = -0.3
"""Without a shift: a wrong sign, which a motion that repeats hides half a period later."""
AVERAGE_S = 0.2
"""Noise, inertia and what a loop makes of it are faster: the mean of so long is what counts."""
OVERLAP = 0.3
"""Of the shorter channel: with less in common, slow motions correlate by chance."""
ALIKE = 0.02
"""Shifts that correlate so nearly as well are as likely: a motion that repeats."""


class CoarseShift(NamedTuple):
    """A shift of channels against others.

    Attributes:
        seconds: positive where they are late [s].
        step: between the shifts that were tried [s].
        correlation: there.
        at_none: without a shift.
        others: how many other shifts are as likely, as of a motion that repeats.
    """

    seconds: float
    step: float
    correlation: float
    at_none: float
    others: int


def coarse_shift(
    time: Array, followers: Array, leader_time: Array, leaders: Array
) -> CoarseShift | None:
    """Return by how much channels are late against others; None where none is sure.

    Args:
        time: of the followers, rising, shape (k,) [s].
        followers: a column each, shape (k, n).
        leader_time: shape (m,) [s].
        leaders: what each follows, of like size and sign, shape (m, n).
    """
    if min(len(time), len(leader_time)) < 3:
        return None
    span = max(float(np.ptp(time)), float(np.ptp(leader_time)))
    step = max(float(np.median(np.diff(time))), float(np.median(np.diff(leader_time))))
    step = max(step, span / MOST_STEPS)
    if not step > 0.0:
        return None
    mine, ours = _even(time, followers, step), _even(leader_time, leaders, step)
    shifts, found = _correlations(mine, ours)
    # Row i of the followers is at time[0] + i·step.
    seconds = shifts * step + float(time[0] - leader_time[0])
    best = int(np.nanargmax(found)) if np.isfinite(found).any() else -1
    if best < 0 or found[best] < SURE:
        return None
    likely = np.flatnonzero(found >= found[best] - ALIKE)
    groups = np.split(likely, np.flatnonzero(np.diff(likely) > 1) + 1)
    tops = [int(each[np.argmax(found[each])]) for each in groups]
    top = min(tops, key=lambda i: abs(seconds[i]))
    none = float(np.interp(0.0, seconds, np.nan_to_num(found)))
    if found[top] - none < GAIN or (len(tops) > 1 and none < OPPOSITE):
        return None
    return CoarseShift(_between(seconds, found, top), step, float(found[top]), none, len(tops) - 1)


def _even(time: Array, table: Array, step: float) -> Array:
    at = np.arange(time[0], time[-1], step)
    even = np.stack([np.interp(at, time, column) for column in table.T], axis=1)
    return np.asarray(uniform_filter1d(even, max(round(AVERAGE_S / step), 1), axis=0))


def _correlations(mine: Array, ours: Array) -> tuple[Array, Array]:
    """Return shifts in steps, and the correlation of all columns together at each."""
    mine, ours = mine - mine.mean(axis=0), ours - ours.mean(axis=0)
    counts = np.round(_all_shifts(np.ones(len(mine)), np.ones(len(ours))))
    common, of_mine, of_ours = np.zeros((3, len(counts)))
    ones = np.ones(len(mine)), np.ones(len(ours))
    for a, b in zip(mine.T, ours.T, strict=True):
        sums = _all_shifts(a, ones[1]), _all_shifts(ones[0], b)
        common += _all_shifts(a, b) - sums[0] * sums[1] / counts
        of_mine += _all_shifts(a**2, ones[1]) - sums[0] ** 2 / counts
        of_ours += _all_shifts(ones[0], b**2) - sums[1] ** 2 / counts
    whole = mine.var() * len(mine) * mine.shape[1], ours.var() * len(ours) * mine.shape[1]
    enough = counts >= OVERLAP * min(len(mine), len(ours))
    # What hardly moves while both were there says nothing.
    enough &= (of_mine > OVERLAP**2 * whole[0]) & (of_ours > OVERLAP**2 * whole[1])
    with np.errstate(invalid="ignore", divide="ignore"):
        found = common / np.sqrt(of_mine * of_ours)
    found[~enough] = np.nan
    return np.asarray(np.arange(len(counts), dtype=np.float64) - (len(ours) - 1)), found


def _all_shifts(a: Array, b: Array) -> Array:
    """Return the sum of a[i + shift]·b[i] at all shifts from 1 − len(b) on."""
    return np.asarray(correlate(a, b, method="fft"))


def _between(seconds: Array, found: Array, top: int) -> float:
    """Return the top of the parabola through three shifts."""
    if not 0 < top < len(found) - 1:
        return float(seconds[top])
    before, here, after = found[top - 1 : top + 2]
    bend = before - 2.0 * here + after
    if not bend < 0.0:
        return float(seconds[top])
    return float(seconds[top] + 0.5 * (before - after) / bend * (seconds[1] - seconds[0]))
