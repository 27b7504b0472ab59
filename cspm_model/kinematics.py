"""Kinematics of the cables, thesis chapter 2: lengths and length rates from poses and twists.

Poses are x y z φ θ ψ in world_ned (m, rad). A cable's vector runs from its exit on the winch frame
to its attachment on the bar (2-2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels.cable import PULLEY_RADIUS, ROUTE
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.rotation import (
    body_rate_to_euler_rate,
    euler_rate_to_world_rate,
    rotation_from_euler,
)
from cspm_model.kernels.route import STOP_COUNT
from cspm_msgs_py.errors import InputError, SingularityError

Array = NDArray[np.float64]

# Euler rates per angular velocity grow without bound towards θ = ±π/2; closer than this they would
# be numbers without meaning.
SMALLEST_COSINE = 1e-3
# Singular values below this share of the largest: near such a pose a length error of a micrometre
# is a pose error without meaning.
RANK_TOLERANCE = 1e-6
LENGTH_TOLERANCE = 1e-9


class CableGeometry(NamedTuple):
    """Lengths (n,) [m] and the maps of both bodies' world twists to length rates, each (n, 6).

    `bar` is J of (2-6) for the twist v, ω in world axes; `frame` is the winch frame's own term.
    """

    lengths: Array
    bar: Array
    frame: Array


def geometry(cables: Array, bar_pose: ArrayLike, frame_pose: ArrayLike) -> CableGeometry:
    """Return lengths and Jacobians for `cables`, the plant's cable parameter rows (n, columns).

    Raises:
        SingularityError: an exit and its attachment coincide, where a cable has no direction, or a
            cable would have to run through a pulley.
    """
    n = len(cables)
    out = CableGeometry(np.empty(n), np.empty((n, 6)), np.empty((n, 6)))
    cable_geometry(cables, _pose(bar_pose), _pose(frame_pose), out.lengths, out.bar, out.frame)
    if not (out.lengths > LENGTH_TOLERANCE).all():
        i = int(np.argmin(out.lengths))
        if np.isnan(out.lengths[i]):
            place = ", ".join(f"{value:.4g}" for value in _pose(bar_pose))
            inside = "its attachment lies inside its pulley"
            allowed = f"outside its radius of {cables[i, PULLEY_RADIUS]:g} m"
            if cables[i, ROUTE + STOP_COUNT] > 0.0:
                inside, allowed = "its route leads through a pulley", "stops outside of pulleys"
            raise SingularityError(
                f"cable {i}: {inside} with the bar at [{place}] (m, rad), allowed: {allowed}"
            )
        raise SingularityError(f"cable {i}: length 0 m, its direction does not exist")
    return out


def inverse_kinematics(cables: Array, bar_pose: ArrayLike, frame_pose: ArrayLike) -> Array:
    """Return the cable lengths (n,) [m], thesis (2-5)."""
    return geometry(cables, bar_pose, frame_pose).lengths


def lengths_between_points(cables: Array) -> Array:
    """Return the lengths (n,) [m] of cables between points of one frame; 0 without a cable."""
    n, origin = len(cables), np.zeros(6)
    lengths, jacobian = np.empty(n), np.empty((n, 6))
    cable_geometry(cables, origin, origin, lengths, jacobian, jacobian.copy())
    return lengths


def euler_rate_map(pose: ArrayLike) -> Array:
    """Return J_w of (2-6), shape (3, 3): ω in world axes = J_w·[φ̇, θ̇, ψ̇]."""
    _, _, _, _, pitch, yaw = _pose(pose)
    columns = [euler_rate_to_world_rate(pitch, yaw, *rate) for rate in np.eye(3)]
    return np.array(columns).T


def euler_rates(pose: ArrayLike, body_rate: ArrayLike) -> Array:
    """Return φ̇, θ̇, ψ̇ for ω in body axes.

    Raises:
        SingularityError: θ is at ±π/2, where the Euler rates do not exist.
    """
    roll, pitch = _pose(pose)[3:5]
    if abs(np.cos(pitch)) < SMALLEST_COSINE:
        raise SingularityError(
            f"pitch {pitch:.6g} rad: Euler rates do not exist at ±π/2, allowed: |cos θ| ≥"
            f" {SMALLEST_COSINE:g}"
        )
    return np.array(body_rate_to_euler_rate(roll, pitch, *np.asarray(body_rate, dtype=float)))


def rotation(pose: ArrayLike) -> Array:
    """Return R_world_body = Rz(ψ)Ry(θ)Rx(φ), shape (3, 3), thesis (2-3)."""
    return np.array(rotation_from_euler(*_pose(pose)[3:6])).reshape(3, 3)


def _pose(value: ArrayLike) -> Array:
    pose = np.asarray(value, dtype=float)
    if pose.shape != (6,) or not np.isfinite(pose).all():
        raise InputError(f"pose {pose!r}: allowed: six finite numbers x y z φ θ ψ")
    return pose
