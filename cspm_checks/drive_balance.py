"""Whether a winch's torque has the signs and sizes of inertia, friction and the cable's pull.

Torque is regressed on acceleration, speed, its sign and the tension, segment by segment; what the
segments differ by is the error. Inertia and friction are positive, whatever their size.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.motion import FEWEST, SEGMENTS, SHORTEST, even, motion_columns, smoothed
from cspm_checks.series import SensorSeries

Array = NDArray[np.float64]
_MOST = 4000
_CONDITION = 1e-6


class Estimate(NamedTuple):
    """A mean over segments, its standard error, and the share of what it explains there."""

    mean: float
    error: float
    share: float

    @property
    def is_sure(self) -> bool:
        """Whether its sign is: four times the error away from 0."""
        return abs(self.mean) > 4.0 * self.error


class Balance(NamedTuple):
    """What a torque consists of.

    Attributes:
        friction: energy that friction takes, of what flows.
        inertia: [kg·m²].
        drum: torque by the tension, of tension times drum radius over gear ratio; None without.
        level: mean torque over mean pull; None where the pull varies by more than its mean.
    """

    friction: Estimate
    inertia: Estimate
    drum: Estimate | None
    level: float | None


def drive_balance(
    torque: SensorSeries, angle: SensorSeries, pull: SensorSeries | None, *, elastic: bool
) -> Balance | None:
    """Return what the torque of a winch consists of; None where the signals cannot tell.

    Args:
        torque: [N·m].
        angle: at the motor shaft [rad].
        pull: tension times drum radius over gear ratio [N·m], where it is measured.
        elastic: whether an unmeasured cable pulls, in proportion to the angle.
    """
    regular = even(angle)
    if regular is None or not len(torque.values) or (pull is not None and not len(pull.values)):
        return None
    time, angles, step = regular
    columns = motion_columns(angles, step, (2, 1))
    if pull is not None:
        columns.append(smoothed(np.interp(time, pull.time, pull.values)))
    elif elastic:
        columns.append(smoothed(angles))
    goal = smoothed(np.interp(time, torque.time, torque.values))
    table = np.stack([*columns, np.ones(len(time))], axis=1)
    length = min(len(goal) // SEGMENTS, _MOST)
    if length < SHORTEST:
        return None
    found = [
        each
        for start in np.linspace(0, len(goal) - length, SEGMENTS).astype(int)
        if (each := _segment(table[start : start + length], goal[start : start + length]))
    ]
    if len(found) < FEWEST:
        return None
    friction, inertia, drum = (_estimate(np.array(one)) for one in zip(*found, strict=True))
    if pull is None:
        return Balance(friction, inertia, None, None)
    return Balance(friction, inertia, drum, _level(goal, table[:, 3]))


def _level(torque: Array, pull: Array) -> float | None:
    """Return mean torque over mean pull, which feedback of a load cell's noise does not change."""
    held = float(np.mean(pull))
    return float(np.mean(torque)) / held if abs(held) > float(np.std(pull)) else None


_Pair = tuple[float, float]


def _segment(table: Array, goal: Array) -> tuple[_Pair, _Pair, _Pair] | None:
    """Return value and share of friction, inertia and pull; None if they are not distinct."""
    size = table.std(axis=0)
    size[-1] = 1.0
    about = goal - goal.mean()
    if (size == 0.0).any() or not about.any():
        return None
    scaled = table / size
    if np.linalg.cond(scaled) > 1.0 / _CONDITION:
        return None
    solution = np.linalg.lstsq(scaled, goal, rcond=None)[0] / size
    speed = table[:, 1]
    taken = float(np.mean((solution[1] * speed + solution[2] * table[:, 2]) * speed))
    flow = float(np.mean(np.abs(about * speed)))
    whole = float(about @ about)
    inertia = float(np.var(solution[0] * table[:, 0])) * len(goal) / whole
    pull = _gain(np.delete(scaled, 3, axis=1), scaled, goal) if table.shape[1] > 4 else 0.0
    return (taken / flow, 1.0), (float(solution[0]), inertia), (float(solution[3]), pull)


def _gain(without: Array, whole: Array, goal: Array) -> float:
    """Return the share that a column explains of what the others leave."""
    left, rest = (
        goal - table @ np.linalg.lstsq(table, goal, rcond=None)[0] for table in (without, whole)
    )
    return 1.0 - float(rest @ rest) / max(float(left @ left), 1e-300)


def _estimate(found: Array) -> Estimate:
    values = found[:, 0]
    error = float(values.std(ddof=1) / np.sqrt(len(values)))
    return Estimate(float(values.mean()), error, float(found[:, 1].mean()))
