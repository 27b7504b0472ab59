"""The nominal bar's equations of motion (2-12) in the coordinates x y z φ θ ψ, both ways."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.rotation import (
    Vector,
    body_rate_to_euler_rate,
    cross,
    euler_from_quaternion,
    euler_rate_to_world_rate,
    rotate,
    rotate_back,
    rotation_from_euler,
)
from cspm_msgs_py.testbed import Bar

Array = NDArray[np.float64]

# Columns of the bar's parameters: centre of mass in bar axes, inertia about it in bar axes, row by
# row, and its inverse.
MASS, GRAVITY, COM, INERTIA, INVERSE, COLUMNS = 0, 1, 2, 5, 14, 23


def bar_parameters(bar: Bar, gravity: float) -> Array:
    """Return the kernels' parameters of a bar (COLUMNS,); gravity in m/s²."""
    inertia = bar.inertia.matrix
    inverse = np.linalg.inv(inertia)
    return np.array([bar.mass, gravity, *bar.com, *inertia.ravel(), *inverse.ravel()])


@njit(cache=True, error_model="numpy")
def wanted_motion(reference: Array, out: Array) -> None:
    """Write coordinates, their rates and accelerations, shape (3, 6), of a reference row (19,)."""
    out[0, 3], out[0, 4], out[0, 5] = euler_from_quaternion(reference[3:7])
    for d in range(3):
        out[0, d], out[1, d], out[2, d] = reference[d], reference[7 + d], reference[13 + d]
    turn = (reference[10], reference[11], reference[12])
    out[1, 3], out[1, 4], out[1, 5] = _euler_rate(out[0], turn)
    bias = _euler_bias(out[0], out[1])
    turn = (reference[16] - bias[0], reference[17] - bias[1], reference[18] - bias[2])
    out[2, 3], out[2, 4], out[2, 5] = _euler_rate(out[0], turn)


@njit(cache=True, error_model="numpy")
def wrench_for(pose: Array, rate: Array, acceleration: Array, bar: Array, out: Array) -> None:
    """Write the wrench (6,) about the bar's origin, world axes, that gives an acceleration.

    `pose`, `rate` and `acceleration` (6,) are x y z φ θ ψ and derivatives.
    """
    rotation = rotation_from_euler(pose[3], pose[4], pose[5])
    spin = euler_rate_to_world_rate(pose[4], pose[5], rate[3], rate[4], rate[5])
    bias = _euler_bias(pose, rate)
    turn = euler_rate_to_world_rate(
        pose[4], pose[5], acceleration[3], acceleration[4], acceleration[5]
    )
    turn = (turn[0] + bias[0], turn[1] + bias[1], turn[2] + bias[2])
    arm = rotate(rotation, bar[COM], bar[COM + 1], bar[COM + 2])
    swing = _of_arm(arm, spin, turn)
    for d in range(3):
        out[d] = bar[MASS] * (acceleration[d] + swing[d])
    out[2] -= bar[MASS] * bar[GRAVITY]
    moment = _gyroscopic(pose, spin, bar)
    inertial = _turned(rotation, bar[INERTIA : INERTIA + 9], turn)
    lever = cross(arm[0], arm[1], arm[2], out[0], out[1], out[2])
    for d in range(3):
        out[3 + d] = inertial[d] + moment[d] + lever[d]


@njit(cache=True, error_model="numpy")
def acceleration_from(pose: Array, rate: Array, wrench: Array, bar: Array, out: Array) -> None:
    """Write the acceleration (6,) of x y z φ θ ψ that a wrench gives; inverse of `wrench_for`."""
    rotation = rotation_from_euler(pose[3], pose[4], pose[5])
    spin = euler_rate_to_world_rate(pose[4], pose[5], rate[3], rate[4], rate[5])
    arm = rotate(rotation, bar[COM], bar[COM + 1], bar[COM + 2])
    lever = cross(arm[0], arm[1], arm[2], wrench[0], wrench[1], wrench[2])
    gyroscopic = _gyroscopic(pose, spin, bar)
    moment = (
        wrench[3] - lever[0] - gyroscopic[0],
        wrench[4] - lever[1] - gyroscopic[1],
        wrench[5] - lever[2] - gyroscopic[2],
    )
    turn = _turned(rotation, bar[INVERSE : INVERSE + 9], moment)
    swing = _of_arm(arm, spin, turn)
    for d in range(3):
        out[d] = wrench[d] / bar[MASS] - swing[d]
    out[2] += bar[GRAVITY]
    bias = _euler_bias(pose, rate)
    turn = (turn[0] - bias[0], turn[1] - bias[1], turn[2] - bias[2])
    out[3], out[4], out[5] = _euler_rate(pose, turn)


@njit(cache=True, error_model="numpy")
def _euler_rate(pose: Array, turn: Vector) -> Vector:
    """Return φ̇, θ̇, ψ̇ for an angular velocity in world axes."""
    rotation = rotation_from_euler(pose[3], pose[4], pose[5])
    x, y, z = rotate_back(rotation, turn[0], turn[1], turn[2])
    return body_rate_to_euler_rate(pose[3], pose[4], x, y, z)


@njit(cache=True, error_model="numpy")
def _euler_bias(pose: Array, rate: Array) -> Vector:
    """Return the time derivative of J_w (2-6) times the Euler rates."""
    cp, sp, cy, sy = cos(pose[4]), sin(pose[4]), cos(pose[5]), sin(pose[5])
    dr, dp, dy = rate[3], rate[4], rate[5]
    return (
        -dr * (sy * cp * dy + cy * sp * dp) - cy * dy * dp,
        dr * (cy * cp * dy - sy * sp * dp) - sy * dy * dp,
        -cp * dp * dr,
    )


@njit(cache=True, error_model="numpy")
def _of_arm(arm: Vector, spin: Vector, turn: Vector) -> Vector:
    """Return the acceleration of a point on the body against its origin."""
    x, y, z = cross(spin[0], spin[1], spin[2], arm[0], arm[1], arm[2])
    inward = cross(spin[0], spin[1], spin[2], x, y, z)
    along = cross(turn[0], turn[1], turn[2], arm[0], arm[1], arm[2])
    return inward[0] + along[0], inward[1] + along[1], inward[2] + along[2]


@njit(cache=True, error_model="numpy")
def _turned(rotation: tuple[float, ...], matrix: Array, v: Vector) -> Vector:
    """Return R·M·Rᵀ·v for M row by row."""
    x, y, z = rotate_back(rotation, v[0], v[1], v[2])
    return rotate(
        rotation,
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[3] * x + matrix[4] * y + matrix[5] * z,
        matrix[6] * x + matrix[7] * y + matrix[8] * z,
    )


@njit(cache=True, error_model="numpy")
def _gyroscopic(pose: Array, spin: Vector, bar: Array) -> Vector:
    rotation = rotation_from_euler(pose[3], pose[4], pose[5])
    x, y, z = _turned(rotation, bar[INERTIA : INERTIA + 9], spin)
    return cross(spin[0], spin[1], spin[2], x, y, z)
