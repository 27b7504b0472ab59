"""Physics that begins during a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.sensors import Fault
from cspm_sim.mujoco.influence import Acting, Influence, Scene

Array = NDArray[np.float64]


class Late:
    """An influence that acts from its onset on; its memory begins then."""

    def __init__(self, influence: Influence, onset: float) -> None:
        """Take the onset [s]."""
        self._influence, self._onset = influence, onset

    def act(self, scene: Scene, acting: Acting) -> None:
        """Act if it has begun."""
        if scene.time >= self._onset:
            self._influence.act(scene, acting)

    def advance(self, scene: Scene, period: float) -> None:
        """Remember if it has begun."""
        if scene.time >= self._onset:
            self._influence.advance(scene, period)


class LateFault:
    """A sensor's fault that is there from its onset on."""

    def __init__(self, fault: Fault, onset: float) -> None:
        """Take the onset [s]."""
        self._fault, self._onset = fault, onset

    def __call__(self, values: Array, time: float) -> Array:
        """Return the readings."""
        return self._fault(values, time) if time >= self._onset else values
