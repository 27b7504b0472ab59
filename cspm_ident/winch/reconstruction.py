"""The torque that a winch's identified equation says, beside the measured one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import smooth
from cspm_ident.winch.recording import WinchSignals, signal_rows
from cspm_sim.effects import catalogue
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]


class TorqueError(NamedTuple):
    """Measured and predicted torque in one band.

    Attributes:
        times: [s], shape (n,).
        measured: [N·m], shape (n,).
        predicted: [N·m], shape (n,).
        speeds: of the motor shaft, not in that band [rad/s], shape (n,).
        percent: 100·|measured − predicted|/|measured|.
    """

    times: Array
    measured: Array
    predicted: Array
    speeds: Array
    percent: float


def torque_error(
    signals: WinchSignals,
    inertia: float,
    effects: Mapping[str, Mapping[str, float]],
    band: float,
    margin: float = 0.2,
) -> TorqueError:
    """Return how well an equation explains the torque of a recording, sample by sample.

    Measured torque and prediction pass the same filter; derivatives of the angle are taken before
    it, in all of the band that exceeds the angle's noise.

    Args:
        signals: the recording.
        inertia: J [kg·m²].
        effects: parameters by effect and name; effects that act at the shaft.
        band: of the filter [Hz].
        margin: left out at the ends of each stretch, where the filter has only one side [s].
    """
    parts = []
    for times, rows in signal_rows(signals):
        skip = round(margin / signals.angle.interval)
        inner = slice(skip, max(skip, len(times) - skip))
        predicted = _predict(rows, signals, inertia, effects)
        both = Samples(times, np.column_stack([rows[:, WinchSignal.TORQUE], predicted]))
        columns = [times, smooth(both, band).at(times), rows[:, WinchSignal.SPEED]]
        parts.append(np.column_stack(columns)[inner])
    table = np.concatenate(parts)
    left = np.linalg.norm(table[:, 1] - table[:, 2])
    percent = 100.0 * left / np.linalg.norm(table[:, 1])
    times, measured, predicted, speeds = table.T
    return TorqueError(times, measured, predicted, speeds, float(percent))


def _predict(
    rows: Array,
    signals: WinchSignals,
    inertia: float,
    effects: Mapping[str, Mapping[str, float]],
) -> Array:
    torque = (inertia + signals.load_inertia) * rows[:, WinchSignal.ACCELERATION]
    torque += signals.load_torque(rows)
    torque += signals.radius * rows[:, WinchSignal.TENSION]
    for name, values in effects.items():
        effect = catalogue()[name]
        torque += _weighted(effect.regressors(rows), effect.weights(values))
    return torque


def _weighted(columns: Array, weights: Sequence[float] | Array) -> Array:
    return np.asarray(columns[:, 0] @ np.asarray(weights))
