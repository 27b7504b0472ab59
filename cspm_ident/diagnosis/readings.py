"""Measured readings in the form that sensor effects' regressors read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_sim.effects.signals import ReadingSignal

Array = NDArray[np.float64]


def reading_rows(times: Array, values: Array) -> Array:
    """Return `ReadingSignal` columns of readings (k,) at times (k,) [s], without their rate."""
    rows = np.zeros((len(times), len(ReadingSignal)))
    rows[:, ReadingSignal.TIME] = times
    rows[:, ReadingSignal.VALUE] = values
    return rows


def pose_rows(times: Array, poses: Array, rates: Array) -> Array:
    """Return `PoseSignal` columns of poses x y z φ θ ψ and their rates, (k, 6) each."""
    return np.column_stack([times, poses, rates])
