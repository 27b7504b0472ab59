"""Position servos: wanted and measured motor angle to motor torque, and the angles wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import AnglePath

Array = NDArray[np.float64]

STILL = AnglePath(points=((0.0, 0.0),))
# Above this share of the sampling rate the servo's own delay takes its damping away.
LARGEST_BANDWIDTH = 0.2


class AngleGenerator:
    """Motor angles as functions of time, from the start's on."""

    def __init__(self, paths: Mapping[str, AnglePath], cables: Sequence[str]) -> None:
        """Take the paths by cable name; cables without one stay.

        Raises:
            InputError: a path names no cable of this machine.
        """
        for name in paths:
            if name not in cables:
                raise InputError(
                    f"control.angle.{name}: no such cable, allowed: {', '.join(cables)}"
                )
        self._paths = [_knots(paths.get(name, STILL)) for name in cables]

    def step(self, stamp_ns: int) -> tuple[Array, Array]:
        """Return the angles (n,) [rad] at `stamp_ns` and their rates (n,) [rad/s]."""
        time = stamp_ns * 1e-9
        found = [_on_path(times, angles, time) for times, angles in self._paths]
        return np.array([angle for angle, _ in found]), np.array([rate for _, rate in found])


def _knots(path: AnglePath) -> tuple[Array, Array]:
    """Return times and angles with all cycles written out."""
    points = np.array(path.points)
    later = [np.add(points[1:], (cycle * points[-1, 0], 0.0)) for cycle in range(path.cycles)]
    whole = np.concatenate([points[:1], *later])
    return whole[:, 0].copy(), whole[:, 1].copy()


def _on_path(times: Array, angles: Array, time: float) -> tuple[float, float]:
    """Return angle and rate; at a corner the rate is that of the line to come."""
    i = int(np.searchsorted(times, time, side="right")) - 1
    if i + 1 >= len(times):
        return float(angles[-1]), 0.0
    rate = float((angles[i + 1] - angles[i]) / (times[i + 1] - times[i]))
    return float(angles[i] + rate * (time - times[i])), rate


class AngleServo:
    """PID per motor on its angle: τ = 3Jω²·e + Jω³·∫e + 3Jω·ė, with rotor inertia J.

    On the rotor alone its three poles lie at −ω. A cable adds its stiffness K to 3Jω², which keeps
    9ω² + 3K/J > ω², Routh's condition, whatever K. The integral carries the cable's tension; it
    stops at the torque limit.
    """

    def __init__(
        self, inertias: Array, torque_limits: Array, bandwidth: float, *, period: float
    ) -> None:
        """Make the servos.

        Args:
            inertias: J at the motor shaft, (n,) [kg·m²].
            torque_limits: (n,) [N·m].
            bandwidth: ω [rad/s].
            period: time between steps [s].

        Raises:
            InputError: the bandwidth is beyond what this period allows.
        """
        largest = LARGEST_BANDWIDTH / period
        if bandwidth > largest * (1.0 + 1e-9):
            raise InputError(
                f"control.bandwidth: {bandwidth:g} rad/s, allowed with a force controller at"
                f" {1.0 / period:g} Hz: at most {largest:g} rad/s"
            )
        self._limits = torque_limits
        self._period = period
        self._kp = 3.0 * inertias * bandwidth**2
        self._ki = inertias * bandwidth**3
        self._kd = 3.0 * inertias * bandwidth
        self._integral = np.zeros(len(inertias))
        self.saturated = 0

    def restart(self, torques: Array) -> None:
        """Begin anew, with the torques (n,) [N·m] that hold the motors."""
        self._integral[:] = torques

    def step(self, wanted: Array, rates: Array, angles: Array, speeds: Array) -> Array:
        """Return motor torques (n,) [N·m] for wanted and measured angles [rad] and rates [rad/s].

        `saturated` then says how many torques stand at their limit.
        """
        error = wanted - angles
        torque = self._kp * error + self._kd * (rates - speeds) + self._integral
        limited: Array = np.clip(torque, -self._limits, self._limits)
        free = (limited == torque) | ((torque > 0.0) != (error > 0.0))
        self._integral += free * self._ki * error * self._period
        self.saturated = int((limited != torque).sum())
        return limited
