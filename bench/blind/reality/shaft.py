"""What acts on a motor shaft without memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]


class _Forgetful:
    def advance(self, scene: Scene, period: float) -> None:
        """Keep no memory."""


class GreaseDrag(_Forgetful):
    """Drag in proportion to speed that thins a little: −c·q̇/(1 + |q̇|/v)^0.1."""

    def __init__(self, coefficient: Array, thinning_speed: float = 20.0) -> None:
        """Take coefficients (n,) [N·m·s/rad] and the speed of thinning [rad/s]."""
        self._coefficient, self._speed = coefficient, thinning_speed

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque against the motion."""
        thin = (1.0 + np.abs(scene.speeds) / self._speed) ** 0.1
        acting.torque -= self._coefficient * scene.speeds / thin


class EddyCurrentDrag(_Forgetful):
    """Brake that is strongest at one speed: −2·m·x/(1 + x²), x = q̇/v."""

    def __init__(self, peak: Array, speed: float = 2.0) -> None:
        """Take the largest torque (n,) [N·m] and the speed at which it is reached [rad/s]."""
        self._peak, self._speed = peak, speed

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque against the motion."""
        x = scene.speeds / self._speed
        acting.torque -= 2.0 * self._peak * x / (1.0 + x * x)


class Cogging(_Forgetful):
    """Torque that repeats along the motor's turn, with a second harmonic of a sixth."""

    def __init__(self, amplitude: Array, order: float, phase: float) -> None:
        """Take amplitudes (n,) [N·m], how often it repeats per turn, and its phase [rad]."""
        self._amplitude, self._order, self._phase = amplitude, order, phase

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque."""
        turned = self._order * scene.angles + self._phase
        acting.torque += self._amplitude * (np.sin(turned) + np.sin(2.0 * turned) / 6.0)


class TorqueOffset(_Forgetful):
    """A drive that adds a constant torque."""

    def __init__(self, torque: Array) -> None:
        """Take the torques (n,) [N·m]."""
        self._torque = torque

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque."""
        acting.torque += self._torque


class TorqueGain(_Forgetful):
    """A drive that delivers a share more than it reports."""

    def __init__(self, excess: Array) -> None:
        """Take the shares (n,)."""
        self._excess = excess

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the torque that the drive does not know of."""
        acting.torque += self._excess * scene.torque


class DrumRunout(_Forgetful):
    """A drum that is not round: a first harmonic of its radius and an eighth of a second."""

    def __init__(self, runout: Array, gear_ratios: Array, phase: float) -> None:
        """Take runouts (n,) [m], gear ratios (n,) and the first harmonic's phase [rad]."""
        self._runout, self._ratios, self._phase = runout, gear_ratios, phase

    def act(self, scene: Scene, acting: Acting) -> None:
        """Change the radius."""
        turned = scene.angles / self._ratios + self._phase
        shape = np.cos(turned) + np.cos(2.0 * turned) / 8.0
        acting.radius += self._runout * shape / self._ratios
