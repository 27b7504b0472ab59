"""What acts on the bar from outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

_STRIPS = 8
GUST_TIME = 3.0  # [s]
GUST_SHARE = 0.1


class StripDrag:
    """Quadratic drag on strips along the bar: force = −C/strips·|v|·v on each, by its own speed."""

    def __init__(self, coefficient: float, length: float) -> None:
        """Take the coefficient of the whole bar [N·s²/m²] and its length [m]."""
        self._share = coefficient / _STRIPS
        self._places = ((np.arange(_STRIPS) + 0.5) / _STRIPS - 0.5) * length

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add force and moment about the bar's origin."""
        arms = self._places[:, None] * scene.rotation[:, 0]
        speed = scene.body[3:6] + np.cross(scene.body[6:], arms)
        force = -self._share * np.linalg.norm(speed, axis=1)[:, None] * speed
        acting.wrench[:3] += force.sum(axis=0)
        acting.wrench[3:] += np.cross(arms, force).sum(axis=0)

    def advance(self, scene: Scene, period: float) -> None:
        """Keep no memory."""


class Wind:
    """A force along world y that wanders a little about its mean (Ornstein and Uhlenbeck)."""

    def __init__(self, force: float, generator: np.random.Generator) -> None:
        """Take the mean [N]."""
        self._mean, self._gust = force, 0.0
        self._generator = generator

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the force."""
        acting.wrench[1] += self._mean * (1.0 + GUST_SHARE * self._gust)

    def advance(self, scene: Scene, period: float) -> None:
        """Let the gust wander."""
        kept = np.exp(-period / GUST_TIME)
        fresh = np.sqrt(1.0 - kept**2) * self._generator.standard_normal()
        self._gust = float(kept * self._gust + fresh)


class OutsideVibration:
    """A force along world y of its own frequency, as of a machine on the same floor."""

    def __init__(self, amplitude: float, frequency: float = 2.7) -> None:
        """Take amplitude [N] and frequency [Hz]."""
        self._amplitude, self._frequency = amplitude, frequency

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the force."""
        acting.wrench[1] += self._amplitude * np.sin(2.0 * np.pi * self._frequency * scene.time)

    def advance(self, scene: Scene, period: float) -> None:
        """Keep no memory."""
