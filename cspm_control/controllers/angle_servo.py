"""Position servos: wanted and measured motor angle to motor torque, and the angles wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import AnglePath

Array = NDArray[np.float64]

STILL = AnglePath(points=((0.0, 0.0),))
# Above this share of the sampling rate the servo's own delay takes its damping away.
LARGEST_BANDWIDTH = 0.2


class AngleGenerator:
    """Motor angles as functions of time, from the start's on.

    Attributes:
        arrays: where each path's knots begin, (n + 1,), and of all knots times [s] and angles
            [rad], (k,) each.
    """

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
        paths_of = [_knots(paths.get(name, STILL)) for name in cables]
        starts = np.cumsum([0, *(len(times) for times, _ in paths_of)])
        times, angles = (np.concatenate(each) for each in zip(*paths_of, strict=True))
        self.arrays = (starts.astype(np.int64), times, angles)

    def step(self, stamp_ns: int) -> tuple[Array, Array]:
        """Return the angles (n,) [rad] at `stamp_ns` and their rates (n,) [rad/s]."""
        count = len(self.arrays[0]) - 1
        wanted, rates = np.empty(count), np.empty(count)
        path_angles(stamp_ns * 1e-9, *self.arrays, wanted, rates)
        return wanted, rates


def _knots(path: AnglePath) -> tuple[Array, Array]:
    """Return times and angles with all cycles written out."""
    points = np.array(path.points)
    later = [np.add(points[1:], (cycle * points[-1, 0], 0.0)) for cycle in range(path.cycles)]
    whole = np.concatenate([points[:1], *later])
    return whole[:, 0].copy(), whole[:, 1].copy()


@njit(cache=True, error_model="numpy", _nrt=False)
def path_angles(
    seconds: float,
    starts: NDArray[np.int64],
    times: Array,
    angles: Array,
    wanted: Array,
    rates: Array,
) -> None:
    """Write angles and rates; at a corner the rate is that of the line to come.

    Knots of path i are those from `starts[i]` to before `starts[i + 1]`.
    """
    for i in range(wanted.shape[0]):
        last = starts[i + 1] - 1
        # The last knot that is not later.
        k, high = starts[i], last
        while k < high:
            middle = (k + high + 1) // 2
            if times[middle] <= seconds:
                k = middle
            else:
                high = middle - 1
        wanted[i], rates[i] = angles[last], 0.0
        if k < last:
            rates[i] = (angles[k + 1] - angles[k]) / (times[k + 1] - times[k])
            wanted[i] = angles[k] + rates[i] * (seconds - times[k])


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
        self.torque_limits, self.period = torque_limits, period
        self.gains = np.stack(
            [
                3.0 * inertias * bandwidth**2,
                inertias * bandwidth**3,
                3.0 * inertias * bandwidth,
            ]
        )
        self.integral = np.zeros(len(inertias))
        self.saturated = 0

    def restart(self, torques: Array) -> None:
        """Begin anew, with the torques (n,) [N·m] that hold the motors."""
        self.integral[:] = torques

    def step(self, wanted: Array, rates: Array, angles: Array, speeds: Array) -> Array:
        """Return motor torques (n,) [N·m] for wanted and measured angles [rad] and rates [rad/s].

        `saturated` then says how many torques stand at their limit.
        """
        torque = np.empty(len(wanted))
        self.saturated = servo_torques(
            *(wanted, rates, angles, speeds, self.gains, self.torque_limits, self.period),
            *(self.integral, torque),
        )
        return torque


@njit(cache=True, error_model="numpy", _nrt=False)
def servo_torques(
    wanted: Array,
    rates: Array,
    angles: Array,
    speeds: Array,
    gains: Array,
    limits: Array,
    period: float,
    integral: Array,
    out: Array,
) -> int:
    """Write what `AngleServo.step` returns; return how many torques stand at their limit."""
    saturated = 0
    for i in range(out.shape[0]):
        error = wanted[i] - angles[i]
        torque = gains[0, i] * error + gains[2, i] * (rates[i] - speeds[i]) + integral[i]
        out[i] = min(limits[i], max(-limits[i], torque))
        if out[i] != torque:
            saturated += 1
        if out[i] == torque or (torque > 0.0) != (error > 0.0):
            integral[i] += gains[1, i] * error * period
    return saturated
