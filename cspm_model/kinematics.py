"""Kinematics of the cables, thesis chapter 2: lengths from poses and poses from lengths.

Poses are x y z φ θ ψ in world_ned (m, rad). A cable's vector runs from its exit on the winch frame
to its attachment on the bar (2-2).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.rotation import (
    body_rate_to_euler_rate,
    euler_rate_to_world_rate,
    rotation_from_euler,
)
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import ConvergenceError, InputError, SingularityError

Array = NDArray[np.float64]

# Euler rates per angular velocity grow without bound towards θ = ±π/2; closer than this they would
# be numbers without meaning.
SMALLEST_COSINE = 1e-3
# Singular values below this share of the largest: near such a pose a length error of a micrometre
# is a pose error without meaning.
RANK_TOLERANCE = 1e-6
STEP_TOLERANCE = 1e-15
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
        SingularityError: an exit and its attachment coincide, where a cable has no direction.
    """
    n = len(cables)
    out = CableGeometry(np.empty(n), np.empty((n, 6)), np.empty((n, 6)))
    cable_geometry(cables, _pose(bar_pose), _pose(frame_pose), out.lengths, out.bar, out.frame)
    if not (out.lengths > LENGTH_TOLERANCE).all():
        i = int(np.argmin(out.lengths))
        raise SingularityError(f"cable {i}: length 0 m, its direction does not exist")
    return out


def inverse_kinematics(cables: Array, bar_pose: ArrayLike, frame_pose: ArrayLike) -> Array:
    """Return the cable lengths (n,) [m], thesis (2-5)."""
    return geometry(cables, bar_pose, frame_pose).lengths


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


def forward_kinematics(
    cables: Array,
    lengths: ArrayLike,
    frame_pose: ArrayLike,
    guess: ArrayLike,
    known: Mapping[str, float] | None = None,
    tolerance: float = 1e-9,
) -> Array:
    """Return the bar's pose (6,) whose cable lengths are `lengths`, nearest to `guess`.

    Args:
        cables: the plant's cable parameter rows.
        lengths: wanted lengths, shape (n,) [m].
        frame_pose: the winch frame's pose.
        guess: start of the search.
        known: DOFs that are given, by name, such as `{"roll": 0.0}`. The thesis's machine needs its
            roll so: all its attachments lie on one line, and turning about it changes no length.
        tolerance: largest allowed difference of a length [m]; measured ones need their noise.

    Raises:
        InputError: `lengths` are not one positive number per cable, or `known` names no or every
            DOF.
        ConvergenceError: no pose near the guess has these lengths, or more than one has.
    """
    known = dict(known or {})
    free = [i for i, dof in enumerate(DOFS) if dof not in known]
    if not free:
        raise InputError("known: all six DOFs, allowed: at least one left to be found")
    base = _pose(guess).copy()
    for name, value in known.items():
        if name not in DOFS:
            raise InputError(f"known: no DOF '{name}', allowed: {', '.join(DOFS)}")
        base[DOFS.index(name)] = value
    wanted = _lengths(lengths, len(cables))

    def pose_of(values: Array) -> Array:
        pose = base.copy()
        pose[free] = values
        return pose

    def residual(values: Array) -> Array:
        return inverse_kinematics(cables, pose_of(values), frame_pose) - wanted

    def slope(values: Array) -> Array:
        return euler_jacobian(cables, pose_of(values), frame_pose)[:, free]

    tolerances = dict.fromkeys(("xtol", "ftol", "gtol"), STEP_TOLERANCE)
    solution = least_squares(residual, base[free], slope, method="trf", **tolerances)
    _check_unique(slope(solution.x), [DOFS[i] for i in free])
    worst = float(np.max(np.abs(solution.fun)))
    if worst > tolerance:
        raise ConvergenceError(
            f"forward kinematics: lengths differ by {worst:.3g} m at the nearest pose, allowed:"
            " lengths that one pose has"
        )
    return pose_of(solution.x)


def euler_jacobian(cables: Array, bar_pose: ArrayLike, frame_pose: ArrayLike) -> Array:
    """Return J of (2-6) for ẋ with Euler rates, rows [uᵀ, (R b × u)ᵀ J_w], shape (n, 6)."""
    jacobian = geometry(cables, bar_pose, frame_pose).bar
    return np.hstack([jacobian[:, :3], jacobian[:, 3:] @ euler_rate_map(bar_pose)])


def _check_unique(slope: Array, names: list[str]) -> None:
    _, values, directions = np.linalg.svd(slope)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    if rank == slope.shape[1]:
        return
    weights = np.abs(directions[rank:]).max(axis=0)
    loose = [name for name, weight in zip(names, weights, strict=True) if weight > 0.1]
    raise ConvergenceError(
        f"forward kinematics: the lengths do not fix {', '.join(loose)} near the guess (rank {rank}"
        f" of {slope.shape[1]}), allowed: give it as known"
    )


def _lengths(value: ArrayLike, count: int) -> Array:
    lengths = np.asarray(value, dtype=float)
    if lengths.shape != (count,):
        raise InputError(f"lengths: shape {lengths.shape}, allowed: ({count},), one per cable")
    if not np.isfinite(lengths).all():
        raise InputError("lengths: not finite, allowed: finite numbers")
    if lengths.min() <= 0.0:
        raise InputError(f"lengths: {lengths.min():g} m, allowed: > 0")
    return lengths


def _pose(value: ArrayLike) -> Array:
    pose = np.asarray(value, dtype=float)
    if pose.shape != (6,) or not np.isfinite(pose).all():
        raise InputError(f"pose {pose!r}: allowed: six finite numbers x y z φ θ ψ")
    return pose
