"""From states and motions to the rows of the contract's messages; see `topics` for the columns."""

from math import cos, floor, sin

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.rotation import (
    euler_rate_to_world_rate,
    quaternion_from_euler,
    rotate,
    rotation_from_euler,
)

Array = NDArray[float64]


@njit(cache=True, error_model="numpy")
def pose_row(pose: Array, out: Array) -> None:
    """Write x y z qx qy qz qw of the pose x y z φ θ ψ to `out`."""
    out[0], out[1], out[2] = pose[0], pose[1], pose[2]
    quaternion_from_euler(pose[3], pose[4], pose[5], out[3:7])


@njit(cache=True, error_model="numpy")
def bar_twist_row(state: Array, out: Array) -> None:
    """Write v and ω in world axes of the bar's state (12 numbers) to `out`."""
    out[0], out[1], out[2] = state[6], state[7], state[8]
    rotation = rotation_from_euler(state[3], state[4], state[5])
    out[3], out[4], out[5] = rotate(rotation, state[9], state[10], state[11])


@njit(cache=True, error_model="numpy")
def motion_twist_row(motion: Array, out: Array) -> None:
    """Write v and ω in world axes of a prescribed motion (18 numbers) to `out`."""
    out[0], out[1], out[2] = motion[6], motion[7], motion[8]
    out[3], out[4], out[5] = euler_rate_to_world_rate(
        motion[4], motion[5], motion[9], motion[10], motion[11]
    )


@njit(cache=True, error_model="numpy")
def reference_row(motion: Array, out: Array) -> None:
    """Write pose, twist and acceleration (19 numbers, world axes) of a motion (18) to `out`."""
    pose_row(motion[:6], out[:7])
    motion_twist_row(motion, out[7:13])
    out[13], out[14], out[15] = motion[12], motion[13], motion[14]
    pitch, yaw = motion[4], motion[5]
    dr, dp, dy = motion[9], motion[10], motion[11]
    ax, ay, az = euler_rate_to_world_rate(pitch, yaw, motion[15], motion[16], motion[17])
    cp, sp, cy, sy = cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    # The rest is the time derivative of J_w (2-6) times the Euler rates.
    out[16] = ax - dr * (sy * cp * dy + cy * sp * dp) - cy * dy * dp
    out[17] = ay + dr * (cy * cp * dy - sy * sp * dp) - sy * dy * dp
    out[18] = az - cp * dp * dr


@njit(cache=True, error_model="numpy")
def corrupt(values: Array, noise: Array, deviation: Array, resolution: Array, out: Array) -> None:
    """Write values + deviation·noise, rounded to the resolution where it is not 0, to `out`."""
    for i in range(values.shape[0]):
        value = values[i] + deviation[i] * noise[i]
        if resolution[i] > 0.0:
            value = resolution[i] * floor(value / resolution[i] + 0.5)
        out[i] = value
