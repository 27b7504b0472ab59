"""The thesis's motion controller: PID per controlled DOF on the bar's pose error (7-2)."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, pi

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.waves.realisation import envelope
from cspm_model.kernels.rotation import cross, euler_from_quaternion, rotate, rotation_from_euler
from cspm_msgs_py.dofs import DOFS, Dof
from cspm_msgs_py.scenario import PidGains
from cspm_msgs_py.testbed import Bar

Array = NDArray[np.float64]

# After a restart the bar is led to its reference within this time [s].
TAKE_UP_S = 5.0


class MotionController:
    """From measured pose and reference to the wanted wrench on the bar, in world_ned.

    The wrench holds the bar's nominal weight and adds PID terms; a DOF without gains (roll in the
    thesis) gets none. The first output is the weight alone: the integrators start so that they
    cancel the proportional term, as far as their limits let them, and the derivative from the first
    error. After a restart the bar is led from where it then is to its reference within
    `TAKE_UP_S`, by minimum jerk, since nothing says how far away it is. Angles differ by the
    shorter way round.

    Attributes:
        gains: proportional, integral and derivative of each DOF, (6, 3).
        limits: largest integral terms, (6,) [N, N·m].
        weight: of the bar [N].
        com: its centre of mass, (3,) [m].
        period: time between steps [s].
        filter: pole of the derivative term [rad/s].
        memory: what is kept from step to step, see `pid`, (4, 6).
    """

    def __init__(
        self,
        gains: Mapping[Dof, PidGains],
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
        self.gains = np.zeros((6, 3))
        for name, gain in gains.items():
            self.gains[DOFS.index(name)] = gain.kp, gain.ki, gain.kd
        self._know(bar, gravity)
        self.limits = np.repeat(np.array(integral_limits, dtype=float), 3)
        self.period = period
        self.filter = derivative_filter
        self.memory = np.zeros((4, 6))
        self._started = False
        # Steps since a restart; None without one, and once the bar has been led to its reference.
        self._since: int | None = None

    def _know(self, bar: Bar, gravity: float) -> None:
        """Keep what is needed of the bar to carry it."""
        self.weight = bar.mass * gravity
        self.com = np.array(bar.com, dtype=float)

    @property
    def terms(self) -> Array:
        """Error [m, rad] and proportional, integral and derivative terms [N, N·m], shape (4, 6).

        Those of the last wrench, by world axis and Euler angle.
        """
        integral, derivative, error, _ = self.memory
        proportional, rate = self.gains[:, 0] * error, self.gains[:, 2] * derivative
        return np.array([error, proportional, integral, rate])

    @property
    def steady(self) -> bool:
        """Whether it has started and leads the bar to no reference."""
        return self._started and self._since is None

    def restart(self) -> None:
        """Let the next wrench be the one that carries the bar, whatever the error."""
        self.memory[:] = 0.0
        self._started = False
        self._since = 0

    def step(self, bar_pose: Array, reference: Array) -> Array:
        """Return the wrench (6,) for a measured pose row (7,) and a reference row (19,)."""
        wrench = np.empty(6)
        pid(
            bar_pose,
            reference,
            self.gains,
            self.limits,
            self.period,
            self.filter,
            self._started,
            self._left(),
            self.memory,
            wrench,
        )
        self._carry(bar_pose, reference, wrench)
        self._started = True
        return wrench

    def _carry(self, bar_pose: Array, reference: Array, wrench: Array) -> None:
        """Add what the bar is given without any error."""
        add_weight(bar_pose, self.weight, self.com, wrench)

    def _left(self) -> float:
        """Return what share of the error at the restart is left out; 0 without a restart."""
        if self._since is None:
            return 0.0
        elapsed = self._since * self.period
        self._since = self._since + 1 if elapsed < TAKE_UP_S else None
        return 1.0 - float(envelope(np.array(elapsed), TAKE_UP_S)[0])


@njit(cache=True, error_model="numpy")
def _turn(angle: float) -> float:
    """Return the same turn within ±π, the shorter way round."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


@njit(cache=True, error_model="numpy")
def pid(
    pose: Array,
    reference: Array,
    gains: Array,
    limits: Array,
    period: float,
    pole: float,
    started: bool,
    left: float,
    memory: Array,
    out: Array,
) -> None:
    """Write the PID terms to `out`.

    Rows of `memory`: integral term, derivative, last error, and the error at a restart, of which
    the share `left` is left out.
    """
    integral, derivative, last, away = memory[0], memory[1], memory[2], memory[3]
    wanted = euler_from_quaternion(reference[3:7])
    found = euler_from_quaternion(pose[3:7])
    for d in range(6):
        error = reference[d] - pose[d] if d < 3 else _turn(wanted[d - 3] - found[d - 3])
        if not started:
            if left > 0.0:
                away[d] = error
                error = 0.0
            last[d] = error
            integral[d] = -gains[d, 0] * error
        else:
            error -= left * away[d]
            integral[d] += gains[d, 1] * error * period
        integral[d] = min(limits[d], max(-limits[d], integral[d]))
        # Backward Euler of s·pole/(s + pole): stable at any rate.
        derivative[d] = (derivative[d] + pole * (error - last[d])) / (1.0 + pole * period)
        last[d] = error
        out[d] = gains[d, 0] * error + integral[d] + gains[d, 2] * derivative[d]


@njit(cache=True, error_model="numpy")
def add_weight(pose: Array, weight: float, com: Array, out: Array) -> None:
    """Add the wrench about the bar frame's origin that holds the weight at this attitude."""
    roll, pitch, yaw = euler_from_quaternion(pose[3:7])
    arm = rotate(rotation_from_euler(roll, pitch, yaw), com[0], com[1], com[2])
    out[2] -= weight
    mx, my, mz = cross(arm[0], arm[1], arm[2], 0.0, 0.0, -weight)
    out[3] += mx
    out[4] += my
    out[5] += mz
