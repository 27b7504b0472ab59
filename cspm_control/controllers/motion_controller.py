"""The thesis's motion controller: PID per controlled DOF on the bar's pose error (7-2)."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, pi

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.rotation import cross, euler_from_quaternion, rotate, rotation_from_euler
from cspm_msgs_py.dofs import DOFS, ControlledDof
from cspm_msgs_py.scenario import PidGains
from cspm_msgs_py.testbed import Bar

Array = NDArray[np.float64]


class MotionController:
    """From measured pose and reference to the wanted wrench on the bar, in world_ned.

    The wrench holds the bar's nominal weight and adds PID terms; a DOF without gains (roll in the
    thesis) gets none. The first output is the weight alone: the integrators start so that they
    cancel the proportional term, as far as their limits let them, and the derivative from the first
    error. Angles differ by the shorter way round.
    """

    def __init__(
        self,
        gains: Mapping[ControlledDof, PidGains],
        bar: Bar,
        gravity: float,
        *,
        period: float,
        derivative_filter: float,
        integral_limits: tuple[float, float],
    ) -> None:
        """Make the controller.

        Args:
            gains: per DOF name.
            bar: nominal mass and centre of mass.
            gravity: [m/s²].
            period: time between steps [s].
            derivative_filter: pole of the derivative term [rad/s].
            integral_limits: largest integral term [N], [N·m]; integration stops there.
        """
        self._gains = np.zeros((6, 3))
        for name, gain in gains.items():
            self._gains[DOFS.index(name)] = gain.kp, gain.ki, gain.kd
        self._weight = bar.mass * gravity
        self._com = np.array(bar.com, dtype=float)
        self._limits = np.repeat(np.array(integral_limits, dtype=float), 3)
        self._period = period
        self._filter = derivative_filter
        self._memory = np.zeros((3, 6))
        self._started = False

    def restart(self) -> None:
        """Let the next wrench be the one that carries the bar, whatever the error."""
        self._memory[:] = 0.0
        self._started = False

    def step(self, bar_pose: Array, reference: Array) -> Array:
        """Return the wrench (6,) for a measured pose row (7,) and a reference row (19,)."""
        wrench = np.empty(6)
        _pid(
            bar_pose,
            reference,
            self._gains,
            self._limits,
            self._period,
            self._filter,
            self._started,
            self._memory,
            wrench,
        )
        _add_weight(bar_pose, self._weight, self._com, wrench)
        self._started = True
        return wrench


@njit(cache=True, error_model="numpy")
def _turn(angle: float) -> float:
    """Return the same turn within ±π, the shorter way round."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


@njit(cache=True, error_model="numpy")
def _pid(
    pose: Array,
    reference: Array,
    gains: Array,
    limits: Array,
    period: float,
    pole: float,
    started: bool,
    memory: Array,
    out: Array,
) -> None:
    """Write the PID terms to `out`; `memory` rows are integral term, derivative and last error."""
    integral, derivative, last = memory[0], memory[1], memory[2]
    wanted = euler_from_quaternion(reference[3:7])
    found = euler_from_quaternion(pose[3:7])
    for d in range(6):
        error = reference[d] - pose[d] if d < 3 else _turn(wanted[d - 3] - found[d - 3])
        if not started:
            last[d] = error
            integral[d] = -gains[d, 0] * error
        else:
            integral[d] += gains[d, 1] * error * period
        integral[d] = min(limits[d], max(-limits[d], integral[d]))
        # Backward Euler of s·pole/(s + pole): stable at any rate.
        derivative[d] = (derivative[d] + pole * (error - last[d])) / (1.0 + pole * period)
        last[d] = error
        out[d] = gains[d, 0] * error + integral[d] + gains[d, 2] * derivative[d]


@njit(cache=True, error_model="numpy")
def _add_weight(pose: Array, weight: float, com: Array, out: Array) -> None:
    """Add the wrench about the bar frame's origin that holds the weight at this attitude."""
    roll, pitch, yaw = euler_from_quaternion(pose[3:7])
    arm = rotate(rotation_from_euler(roll, pitch, yaw), com[0], com[1], com[2])
    out[2] -= weight
    mx, my, mz = cross(arm[0], arm[1], arm[2], 0.0, 0.0, -weight)
    out[3] += mx
    out[4] += my
    out[5] += mz
