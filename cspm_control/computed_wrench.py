"""Motion control by computed wrench: inverse dynamics of the bar about an observed error."""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.dofs import DOFS, Dof
from cspm_msgs_py.testbed import Testbed
from cspm_sim.kernels.rotation import (
    Matrix,
    Vector,
    cross,
    euler_from_quaternion,
    rotate,
    rotate_back,
    rotation_from_euler,
)

Array = NDArray[np.float64]


class ComputedWrench:
    """From measured pose and reference to the wanted wrench on the bar, in world_ned.

    The wrench gives the nominal bar (2-12) the reference's acceleration, plus ωc²·e + 2ωc·ė + δ per
    world axis: e the pose error (positions, and the rotation vector from pose to reference), δ the
    acceleration by which it drifts for reasons unknown. A critically damped observer of third
    order tells all three from the pose alone (extended state observer, Han 2009; as a filter of
    samples: Brookner 1998, fading memory, degree 2). δ is what the integral term of a PID would
    hold, without a memory of its own that winds up while a wrench is not met.

    Where roll is not controlled, the sway force damps it: the bar is a pendulum about the cables'
    attachments.
    """

    def __init__(
        self,
        bandwidth: Mapping[Dof, float],
        testbed: Testbed,
        *,
        observer_bandwidth: float,
        roll_damping: float,
        period: float,
    ) -> None:
        """Make the controller for a test-bed with a bar.

        Args:
            bandwidth: ωc per DOF [rad/s]; a DOF that is absent gets no feedback.
            testbed: the nominal machine.
            observer_bandwidth: of the observer [rad/s].
            roll_damping: of the bar's roll where it is not controlled, as a share of critical.
            period: time between steps [s].
        """
        assert testbed.bar is not None
        bar = testbed.bar
        self._gains = np.zeros((6, 2))
        for name, frequency in bandwidth.items():
            self._gains[DOFS.index(name)] = frequency**2, 2.0 * frequency
        damping = 0.0 if "roll" in bandwidth else _roll_force(testbed, roll_damping)
        self._bar = np.array([bar.mass, *bar.com, testbed.gravity, damping])
        self._inertia = bar.inertia.matrix
        fade = exp(-observer_bandwidth * period)
        self._observer = np.array(
            [
                1.0 - fade**3,
                1.5 * (1.0 - fade) ** 2 * (1.0 + fade) / period,
                (1.0 - fade) ** 3 / period**2,
            ]
        )
        self._period = period
        self._memory = np.zeros((4, 6))
        self._started = False

    def restart(self) -> None:
        """Let the next wrench be the one that follows the reference, whatever the error."""
        self._started = False

    def step(self, bar_pose: Array, reference: Array) -> Array:
        """Return the wrench (6,) for a measured pose row (7,) and a reference row (19,)."""
        wrench = np.empty(6)
        feedback = self._memory[3]
        error = np.empty(6)
        _pose_error(bar_pose, reference, error)
        if self._started:
            _observe(error, self._observer, self._period, self._memory)
        else:
            # So that there is no feedback at first.
            self._memory[0], self._memory[1] = error, 0.0
            self._memory[2] = -self._gains[:, 0] * error
        feedback[:] = (
            self._gains[:, 0] * self._memory[0]
            + self._gains[:, 1] * self._memory[1]
            + self._memory[2] * (self._gains[:, 0] > 0.0)
        )
        _inverse_dynamics(
            bar_pose, reference, feedback, self._memory[1], self._bar, self._inertia, wrench
        )
        self._started = True
        return wrench


def _roll_force(testbed: Testbed, damping: float) -> float:
    """Return the sway force per roll rate [N·s] that damps the roll, 0 where none can.

    The cables hold the bar at a height h above its centre of mass: it swings with ω² = m·g·h/Ixx,
    and a sway force F turns it by F·h.
    """
    assert testbed.bar is not None
    bar = testbed.bar
    height = bar.com[2] - float(np.mean([cable.attachment[2] for cable in testbed.cables]))
    if height <= 0.0:
        return 0.0
    inertia = bar.inertia.ixx
    return -2.0 * damping * sqrt(bar.mass * testbed.gravity * height * inertia) / height


@njit(cache=True, error_model="numpy")
def _pose_error(pose: Array, reference: Array, out: Array) -> None:
    """Write position error and rotation vector from pose to reference, world axes, shorter way."""
    for d in range(3):
        out[d] = reference[d] - pose[d]
    ax, ay, az, aw = reference[3], reference[4], reference[5], reference[6]
    bx, by, bz, bw = -pose[3], -pose[4], -pose[5], pose[6]
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    sine = np.sqrt(x * x + y * y + z * z)
    factor = 2.0 / w if sine < 1e-9 * abs(w) else 2.0 * np.arctan2(sine, abs(w)) / sine
    factor = abs(factor) if w >= 0.0 else -abs(factor)
    out[3], out[4], out[5] = factor * x, factor * y, factor * z


@njit(cache=True, error_model="numpy")
def _observe(error: Array, gains: Array, period: float, memory: Array) -> None:
    """Advance `memory`: error, its rate, its unexplained acceleration, the feedback given."""
    for d in range(6):
        acceleration = memory[2, d] - memory[3, d]
        ahead = memory[0, d] + period * (memory[1, d] + 0.5 * period * acceleration)
        surprise = error[d] - ahead
        memory[0, d] = ahead + gains[0] * surprise
        memory[1, d] += period * acceleration + gains[1] * surprise
        memory[2, d] += gains[2] * surprise


@njit(cache=True, error_model="numpy", inline="always")
def _turn_inertia(rotation: Matrix, inertia: Array, v: Vector) -> Vector:
    """Return R·I·Rᵀ·v."""
    x, y, z = rotate_back(rotation, v[0], v[1], v[2])
    return rotate(
        rotation,
        inertia[0, 0] * x + inertia[0, 1] * y + inertia[0, 2] * z,
        inertia[1, 0] * x + inertia[1, 1] * y + inertia[1, 2] * z,
        inertia[2, 0] * x + inertia[2, 1] * y + inertia[2, 2] * z,
    )


@njit(cache=True, error_model="numpy")
def _inverse_dynamics(
    pose: Array,
    reference: Array,
    feedback: Array,
    error_rate: Array,
    bar: Array,
    inertia: Array,
    out: Array,
) -> None:
    """Write the wrench about the bar's origin for the wanted acceleration, (2-12).

    `bar` is mass, centre of mass in bar axes, gravity and the roll damping force per rate.
    """
    roll, pitch, yaw = euler_from_quaternion(pose[3:7])
    rotation = rotation_from_euler(roll, pitch, yaw)
    arm = rotate(rotation, bar[1], bar[2], bar[3])
    spin = (
        reference[10] - error_rate[3],
        reference[11] - error_rate[4],
        reference[12] - error_rate[5],
    )
    turn = (
        reference[16] + feedback[3],
        reference[17] + feedback[4],
        reference[18] + feedback[5],
    )
    swing = cross(turn[0], turn[1], turn[2], arm[0], arm[1], arm[2])
    inward = cross(spin[0], spin[1], spin[2], arm[0], arm[1], arm[2])
    inward = cross(spin[0], spin[1], spin[2], inward[0], inward[1], inward[2])
    roll_rate = rotate_back(rotation, spin[0], spin[1], spin[2])[0]
    sideways = rotate(rotation, 0.0, 1.0, 0.0)
    fall = (0.0, 0.0, bar[4])
    for d in range(3):
        linear = reference[13 + d] + feedback[d] + swing[d] + inward[d]
        out[d] = bar[0] * (linear - fall[d]) + bar[5] * roll_rate * sideways[d]
    momentum = _turn_inertia(rotation, inertia, spin)
    moment = _turn_inertia(rotation, inertia, turn)
    gyroscopic = cross(spin[0], spin[1], spin[2], momentum[0], momentum[1], momentum[2])
    lever = cross(arm[0], arm[1], arm[2], out[0], out[1], out[2])
    for d in range(3):
        out[3 + d] = moment[d] + gyroscopic[d] + lever[d]
