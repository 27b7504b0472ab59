"""How late one channel is against what it must follow: torque against motion, speed against angle.

A shift in time is found segment by segment, where the one explains the other best by least squares.
What the segments differ by is the error, so that nothing is assumed about noise. A shift that grows
along the recording is a drift of the clocks. Only for this check, signals are smoothed and brought
to common instants.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_checks.motion import (
    FEWEST,
    SEGMENTS,
    SHORTEST,
    even,
    motion_columns,
    smoothed,
)
from cspm_checks.series import SensorSeries

Array = NDArray[np.float64]
LONGEST_S = 0.25
"""How far is looked: a quarter of a second, more than buses and filters of such machines take."""
LEAST_SAMPLES = 1.0
"""A drive reports what it held since the stamp before, which is half a sample; a sample is late."""
SIGMAS = 4.0
EXPLAINED = 0.9
GAIN = 0.8
"""What the best shift must leave of the squares that no shift leaves."""
_MOST = 4000  # samples of a segment
_LAGS = 100
_STILL = 1e-9


class Lateness(NamedTuple):
    """How late a channel is.

    Attributes:
        seconds: in the middle of the recording [s], positive where it is late.
        error: half the interval of 95 % [s].
        drift: s per s; 0 where it is not significant.
        drift_error: half its interval of 95 %.
        interval: of the samples [s].
    """

    seconds: float
    error: float
    drift: float
    drift_error: float
    interval: float

    @property
    def matters(self) -> bool:
        """Whether it is significant, and more than a sample."""
        sigma = self.error / 2.0
        late = abs(self.seconds) > max(SIGMAS * sigma, LEAST_SAMPLES * self.interval)
        return late or self.drift != 0.0


def lateness(
    follower: SensorSeries,
    leader: SensorSeries,
    others: Sequence[SensorSeries],
    orders: Sequence[int],
) -> Lateness | None:
    """Return how late a channel is against a position; None where the signals cannot tell.

    Args:
        follower: the channel that may be late.
        leader: the position.
        others: further series that the channel follows, none of them late.
        orders: which derivatives of the position the channel follows; with the first comes its
            sign, as friction does.
    """
    regular = even(leader)
    if regular is None or not all(len(one.values) for one in (follower, *others)):
        return None
    time, angle, step = regular
    columns = motion_columns(angle, step, orders)
    columns += [smoothed(np.interp(time, one.time, one.values)) for one in others]
    goal = smoothed(np.interp(time, follower.time, follower.values))
    inside = (time >= follower.time[0]) & (time <= follower.time[-1])
    first, last = np.flatnonzero(inside)[[0, -1]] if inside.any() else (0, 0)
    table = np.stack([*columns, np.ones(len(time))], axis=1)[first : last + 1]
    found = _by_segments(table, goal[first : last + 1], time[first : last + 1], step)
    return None if len(found) < FEWEST else _combined(np.array(found), step)


def _by_segments(table: Array, goal: Array, time: Array, step: float) -> list[tuple[float, float]]:
    """Return middle and shift [s] of each segment that determines one."""
    # Parabolas find the place between samples: a hundred to each side are enough.
    every = max(int(LONGEST_S / step / _LAGS), 1)
    table, goal, time, step = table[::every], goal[::every], time[::every], step * every
    count = min(SEGMENTS, len(goal) // SHORTEST)
    if count < FEWEST:
        return []
    most = min(int(LONGEST_S / step), len(goal) // (4 * count))
    length = min(len(goal) // count, _MOST)
    if most < 2:
        return []
    found = []
    for start in np.linspace(0, len(goal) - length, count).astype(int):
        inner = slice(start + most, start + length - most)
        shift = _best_shift(table[inner], goal[start : start + length], most)
        if shift is not None:
            found.append((float(time[start + length // 2]), shift * step))
    return found


def _best_shift(table: Array, goal: Array, most: int) -> float | None:
    """Return by how many samples the goal is late, None if the table does not explain it."""
    if np.std(goal) <= _STILL * np.abs(goal).max():
        return None
    basis = _basis(table)
    windows = np.lib.stride_tricks.sliding_window_view(goal, len(table))
    whole = (windows**2).sum(axis=1)
    left = whole - ((windows @ basis) ** 2).sum(axis=1)
    about = whole - windows.sum(axis=1) ** 2 / len(table)
    best = int(np.argmin(left))
    if best in (0, 2 * most) or left[best] > (1 - EXPLAINED) * about[best]:
        return None
    before, here, after = left[best - 1 : best + 2]
    bend = before - 2 * here + after
    if bend <= 0:
        return None
    shift = best + 0.5 * (before - after) / bend - most
    return float(shift) if left[best] < GAIN * left[most] else 0.0


def _basis(table: Array) -> Array:
    size = np.linalg.norm(table, axis=0)
    left, values, _ = np.linalg.svd(table[:, size > 0] / size[size > 0], full_matrices=False)
    return np.asarray(left[:, values > 1e-6 * values[0]])


def _combined(found: Array, step: float) -> Lateness:
    """Return shift and drift of segments given as middle and shift, shape (k, 2) [s]."""
    time, shift = found[:, 0] - found[:, 0].mean(), found[:, 1]
    count = len(shift)
    slope = float(time @ shift / (time @ time))
    rest = shift - shift.mean() - slope * time
    sigma = float(np.sqrt(rest @ rest / (count - 2))) + 1e-3 * step
    wide = float(student.ppf(0.975, count - 2))
    drift_error = wide * sigma / float(np.sqrt(time @ time))
    drifts = abs(slope) > 2 * drift_error and abs(slope) * np.ptp(time) > LEAST_SAMPLES * step
    error = wide * sigma / np.sqrt(count)
    return Lateness(float(shift.mean()), float(error), slope if drifts else 0.0, drift_error, step)
