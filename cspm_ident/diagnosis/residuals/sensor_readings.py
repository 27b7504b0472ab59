"""Measured readings as signals for the regressors of sensor effects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.samples import Samples
from cspm_model.robust_statistics import difference_noise
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects.signals import ReadingSignal

Array = NDArray[np.float64]


def reading_rows(times: Array, values: Array, others: Array | float = 0.0) -> Array:
    """Return `ReadingSignal` columns of readings (k,) at times (k,) [s].

    `others` is the mean of the sensor's other readings, (k,) as well; see `mean_of_others`.
    """
    rows = np.zeros((len(times), len(ReadingSignal)))
    rows[:, ReadingSignal.TIME] = times
    rows[:, ReadingSignal.VALUE] = values
    rows[:, ReadingSignal.RATE] = np.gradient(values, times)
    rows[:, ReadingSignal.OTHERS] = others
    return rows


def mean_of_others(readings: Array, i: int) -> Array:
    """Return the mean of readings (k, n) without column i, (k,); what is missing counts as 0."""
    others = np.nan_to_num(np.delete(readings, i, axis=1))
    return np.asarray(others.sum(axis=1) / max(1, others.shape[1]))


def pose_rows(times: Array, poses: Array, rates: Array) -> Array:
    """Return `PoseSignal` columns of poses x y z φ θ ψ and their rates, (k, 6) each."""
    return np.column_stack([times, poses, rates])


def moving(poses: Samples | None, noise_ratio: float) -> list[str]:
    """Return the coordinates that move by more than a multiple of their noise.

    The residual contains that noise as well.
    """
    if poses is None or len(poses.times) < 5:
        return []
    spread, noise = poses.values.std(axis=0), difference_noise(poses.values)
    return [dof for dof, moves in zip(DOFS, spread > noise_ratio * noise, strict=True) if moves]


_READING_STEP = 1e-6  # m, rad or N


def small_step(change: Array) -> float:
    """Return the factor by which a change is small enough for linearisation."""
    return _READING_STEP / (float(np.max(np.abs(change))) + 1e-300)
