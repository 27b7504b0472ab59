"""Dry friction with bristles (LuGre): it slides smoothly out of a presliding range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]
Level = Callable[[Scene], Array]

PRESLIDING = 0.01  # [rad] at the motor shaft
RELAXATION = 2e-3  # [s]; the bristles' damper in units of their spring
WRAP = 0.5 * np.pi  # of a cable over its pulley [rad]


class BristleFriction:
    """LuGre friction on motor shafts.

    With y the bristles' deflection in units of the presliding range s and g the level:
    torque = −g·(y + σ·ẏ), s·ẏ = q̇ − |q̇|·y. Canudas de Wit et al., IEEE Trans. Automatic Control
    40 (1995).
    """

    def __init__(self, level: Level, n: int) -> None:
        """Take the level g [N·m] as a function of the scene, (n,)."""
        self._level = level
        self._deflection = np.zeros(n)

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque against the motion."""
        speed = scene.speeds
        rate = (speed - np.abs(speed) * self._deflection) / PRESLIDING
        acting.torque -= self._level(scene) * (self._deflection + RELAXATION * rate)

    def advance(self, scene: Scene, period: float) -> None:
        """Deflect the bristles, implicitly, so that they stay within their range at any speed."""
        step = scene.speeds * period / PRESLIDING
        self._deflection = (self._deflection + step) / (1.0 + np.abs(step))


def coulomb(torque: Array) -> BristleFriction:
    """Return friction of a constant level (n,) [N·m]."""
    return BristleFriction(lambda scene: torque, len(torque))


def stribeck(excess: Array, coulomb_torque: Array, speed: float) -> BristleFriction:
    """Return friction that falls from breakaway by an excess (n,) [N·m] within a speed [rad/s]."""

    def level(scene: Scene) -> Array:
        return np.asarray(coulomb_torque + excess * np.exp(-((scene.speeds / speed) ** 2)))

    return BristleFriction(level, len(excess))


def load_dependent(coefficient: Array, radii: Array) -> BristleFriction:
    """Return friction of level coefficient·tension·radius; `radii` (n,) [m/rad] at the shaft."""
    return BristleFriction(lambda scene: coefficient * radii * scene.tensions, len(coefficient))


class CapstanFriction:
    """A pulley between winch and load cell: the winch's side carries t·exp(coefficient·wrap·y).

    y goes from −1 to 1 within the presliding range, as the bristles of `BristleFriction`.
    """

    def __init__(self, coefficient: Array, radii: Array) -> None:
        """Take friction coefficients (n,) and drum radii (n,) [m/rad] at the shaft."""
        self._exponent, self._radii = coefficient * WRAP, radii
        self._deflection = np.zeros(len(coefficient))

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque of what the winch carries beyond the free cable's tension."""
        beyond = np.expm1(self._exponent * self._deflection)
        acting.torque -= self._radii * scene.tensions * beyond

    def advance(self, scene: Scene, period: float) -> None:
        """Turn the contact over."""
        step = scene.speeds * period / PRESLIDING
        self._deflection = (self._deflection + step) / (1.0 + np.abs(step))
