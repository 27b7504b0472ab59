"""Rotations and cable geometry along a trajectory, a row per instant."""

import numpy as np
from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import cable_spans
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.rotation import (
    Placement,
    euler_from_quaternion,
    euler_rate_to_world_rate,
    rotate_back,
    rotation_from_euler,
)

Array = NDArray[float64]
# Of a body: poses (k, 6), rotations (k, 3, 3), velocities and ω in world axes, (k, 3) each.
Motions = tuple[Array, Array, Array, Array]


@njit(cache=True, error_model="numpy", nogil=True)
def eulers_along(quaternions: Array, out: Array) -> None:
    """Write φ θ ψ, (k, 3), of quaternions x y z w, (k, 4)."""
    for k in range(len(quaternions)):
        out[k, 0], out[k, 1], out[k, 2] = euler_from_quaternion(quaternions[k])


@njit(cache=True, error_model="numpy", nogil=True)
def twists_along(poses: Array, rates: Array, out: Array) -> None:
    """Write v and ω in world axes, (k, 6), of poses x y z φ θ ψ and their rates, (k, 6) each."""
    for k in range(len(poses)):
        pose, rate = poses[k], rates[k]
        out[k, 0], out[k, 1], out[k, 2] = rate[0], rate[1], rate[2]
        turning = euler_rate_to_world_rate(pose[4], pose[5], rate[3], rate[4], rate[5])
        out[k, 3], out[k, 4], out[k, 5] = turning


@njit(cache=True, error_model="numpy", nogil=True)
def body_rates_along(poses: Array, turning: Array, out: Array) -> None:
    """Write ω in body axes, (k, 3), of ω in world axes, (k, 3), at poses (k, 6)."""
    for k in range(len(poses)):
        rotation = rotation_from_euler(poses[k, 3], poses[k, 4], poses[k, 5])
        rate = rotate_back(rotation, turning[k, 0], turning[k, 1], turning[k, 2])
        out[k, 0], out[k, 1], out[k, 2] = rate


@njit(cache=True, error_model="numpy", nogil=True)
def lengths_along(
    cables: Array,
    bars: Array,
    frames: Array,
    bar_twists: Array,
    frame_twists: Array,
    lengths: Array,
    bar_rates: Array,
    frame_rates: Array,
) -> None:
    """Write the cables' lengths, and their rates due to bar and winch frame, (k, n) each.

    `cables` are parameter rows; poses `bars`, `frames` and twists in world axes have shape (k, 6).
    What is NaN stays NaN.
    """
    n = cables.shape[0]
    of_bar, of_frame = np.empty((n, 6)), np.empty((n, 6))
    for k in range(len(bars)):
        cable_geometry(cables, bars[k], frames[k], lengths[k], of_bar, of_frame)
        for i in range(n):
            bar_rates[k, i] = frame_rates[k, i] = 0.0
            for d in range(6):
                bar_rates[k, i] += of_bar[i, d] * bar_twists[k, d]
                frame_rates[k, i] += of_frame[i, d] * frame_twists[k, d]


@njit(cache=True, error_model="numpy", forceinline=True)
def _placement(body: Motions, k: int) -> Placement:
    p, r, v, w = body[0][k], body[1][k], body[2][k], body[3][k]
    return (
        (p[0], p[1], p[2]),
        (r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]),
        (v[0], v[1], v[2]),
        (w[0], w[1], w[2]),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def spans_along(cables: Array, frame: Motions, bar: Motions, out: Array) -> None:
    """Write all cables' spans, (k, n, SPAN_COLUMNS), without tensions; see `cable_spans`.

    `cables` are parameter rows.
    """
    for k in range(len(out)):
        cable_spans(cables, _placement(frame, k), _placement(bar, k), out[k])
