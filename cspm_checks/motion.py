"""An angle and its derivatives at equal steps, for checks that compare channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from cspm_checks.series import SensorSeries

Array = NDArray[np.float64]
SEGMENTS, FEWEST = 8, 4
SHORTEST = 200
"""Samples of a segment."""
_SMOOTH, _ORDER = 15, 3
_UNEVEN = 0.1


def even(series: SensorSeries) -> tuple[Array, Array, float] | None:
    """Return instants at equal steps, values there and the step; None if stamps are too uneven."""
    steps = np.diff(series.time)
    if len(steps) < FEWEST * SHORTEST:
        return None
    step = float(np.median(steps))
    if step <= 0 or np.mean(np.abs(steps - step) > _UNEVEN * step) > _UNEVEN:
        return None
    time = np.arange(series.time[0], series.time[-1], step)
    return time, np.interp(time, series.time, series.values), step


def smoothed(values: Array, derivative: int = 0, step: float = 1.0) -> Array:
    """Return values at equal steps, or a derivative, by polynomials over 15 of them."""
    return np.asarray(savgol_filter(values, _SMOOTH, _ORDER, deriv=derivative, delta=step))


def motion_columns(angle: Array, step: float, orders: Sequence[int]) -> list[Array]:
    """Return derivatives of an angle, and with more than one of them the sign of its speed.

    Args:
        angle: at equal steps, shape (n,).
        step: between them [s].
        orders: which derivatives.
    """
    found = [smoothed(angle, order, step) for order in orders]
    if len(orders) > 1:
        speed = smoothed(angle, 1, step)
        noise = float(np.std(np.diff(speed))) or 1.0
        found.append(np.tanh(speed / noise))
    return found
