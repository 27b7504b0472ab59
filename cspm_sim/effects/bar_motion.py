"""Kinematics of the measured bar that several of its regressors need."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_sim.effects.effect import Array
from cspm_sim.effects.signals import BarSignal


class BarMotion(NamedTuple):
    """Over the samples, in world axes where not said.

    Attributes:
        rotation: R_world_bar, (samples, 3, 3).
        omega: (samples, 3) [rad/s].
        alpha: (samples, 3) [rad/s²].
        com: from the bar frame's origin to the centre of mass, (samples, 3) [m].
        falling: gravity less the acceleration of the centre of mass, (samples, 3) [m/s²].
    """

    rotation: Array
    omega: Array
    alpha: Array
    com: Array
    falling: Array


def bar_motion(signals: Array) -> BarMotion:
    """Return what `BarSignal` columns say of the motion."""
    turn = BarSignal.VELOCITY + 3
    omega, alpha = signals[:, turn : turn + 3], signals[:, turn + 6 : turn + 9]
    rotation = signals[:, BarSignal.ROTATION : BarSignal.ROTATION + 9].reshape(-1, 3, 3)
    com = np.einsum("kij,kj->ki", rotation, signals[:, BarSignal.COM : BarSignal.COM + 3])
    moved = signals[:, BarSignal.ACCELERATION : BarSignal.ACCELERATION + 3] + carried(
        omega, alpha, com
    )
    falling = -moved
    falling[:, 2] += signals[:, BarSignal.GRAVITY]
    return BarMotion(rotation, omega, alpha, com, falling)


def carried(omega: Array, alpha: Array, arm: Array) -> Array:
    """Return α × arm + ω × (ω × arm), (samples, 3)."""
    return np.asarray(np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm)))
