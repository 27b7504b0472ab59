"""A load that swings below the bar."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

STRAP = 0.5  # [m]
BOUNCE = 8.0  # of the load on its strap [Hz]
_DAMPING = 0.1  # of that bounce, as a share of the critical one
_STEP = 5e-4  # [s]


class StrappedLoad:
    """A weight on an elastic strap at the bar's origin, which pulls only while it is taut."""

    def __init__(self, mass: float, gravity: float) -> None:
        """Take mass [kg] and gravity [m/s²]."""
        self._mass, self._gravity = mass, np.array([0.0, 0.0, gravity])
        self._spring = (2.0 * np.pi * BOUNCE) ** 2  # per mass
        self._damper = 2.0 * _DAMPING * np.sqrt(self._spring)
        self._place: Array | None = None
        self._velocity = np.zeros(3)

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the strap's pull."""
        if self._place is None:
            acting.wrench[:3] += self._mass * self._gravity
            return
        pulled = self._pull(self._place, self._velocity, scene)
        acting.wrench[:3] -= self._mass * pulled

    def advance(self, scene: Scene, period: float) -> None:
        """Let the load swing for a period, from hanging still at first."""
        if self._place is None:
            sunk = STRAP + float(self._gravity[2]) / self._spring
            self._place = scene.body[:3] + np.array([0.0, 0.0, sunk])
            self._velocity = scene.body[3:6].copy()
            return
        steps = max(1, int(np.ceil(period / _STEP)))
        for _ in range(steps):
            acceleration = self._gravity + self._pull(self._place, self._velocity, scene)
            self._velocity = self._velocity + acceleration * (period / steps)
            self._place = self._place + self._velocity * (period / steps)

    def _pull(self, place: Array, velocity: Array, scene: Scene) -> Array:
        """Return what the strap exerts on the load, per mass, (3,) [m/s²]."""
        apart = place - scene.body[:3]
        length = float(np.linalg.norm(apart))
        along = apart / length
        rate = float((velocity - scene.body[3:6]) @ along)
        stretch = self._spring * (length - STRAP) + self._damper * rate
        return np.asarray(-along * max(0.0, stretch) * (length > STRAP))
