"""Where the machine hangs at rest: tensions, bar attitude and unstretched lengths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels.cable import OFFSET_LENGTH, elastic_tension, law_scale
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import geometry, rotation
from cspm_model.spanned_axes import gyration_radius, spanned_axes, structures_at
from cspm_msgs_py.errors import ConvergenceError

Array = NDArray[np.float64]

WRENCH_TOLERANCE = 1e-9  # of the weight
RESIDUAL_TOLERANCE = 1e-6
RANK_TOLERANCE = 1e-9
SEARCH_TOLERANCE = 1e-12
ROLL = 3


class Equilibrium(NamedTuple):
    """A state of rest.

    Attributes:
        bar_pose: x y z φ θ ψ, its roll adapted where the cables cannot hold the wanted one.
        tensions: shape (n,) [N].
        unstretched_lengths: shape (n,) [m].
    """

    bar_pose: Array
    tensions: Array
    unstretched_lengths: Array


NOTHING = np.zeros(6)
# Share of the largest singular value of the structure matrix, below which it hardly holds.
_WEAK = 0.01


def gravity_wrench(parameters: PlantParameters, bar_pose: ArrayLike) -> Array:
    """Return gravity's force and moment about the bar frame's origin in world axes, shape (6,)."""
    bar = parameters.bar
    force = np.array([0.0, 0.0, bar[bar_kernel.MASS] * bar[bar_kernel.GRAVITY]])
    arm = rotation(bar_pose) @ bar[bar_kernel.COM : bar_kernel.COM + 3]
    return np.concatenate([force, np.cross(arm, force)])


def find_equilibrium(
    parameters: PlantParameters,
    bar_pose: ArrayLike,
    frame_pose: ArrayLike,
    limits: Array,
    load: Array = NOTHING,
) -> Equilibrium:
    """Return the state of rest at `bar_pose`, tensions least in norm within `limits` (n, 2) [N].

    Where the cables cannot balance every moment (the thesis's machine, in roll), the roll is found
    at which gravity needs none; of a machine whose cables give still less, all that they do not
    give. Where they balance one only with tensions beyond the limits, as of the same machine with
    ends a little off, the coordinate in which they are weakest is found. `load` is a wrench on the
    bar beside gravity's, (6,), world axes.

    Raises:
        ConvergenceError: no tensions within the limits hold the bar at rest near this pose.
    """
    pose = np.array(bar_pose, dtype=float)
    if not _balanced(parameters, pose, frame_pose, load):
        structures = structures_at(parameters, pose[None], np.array([frame_pose], dtype=float))
        free = [axis for axis in range(6) if axis not in spanned_axes(structures)]
        if free in ([], [ROLL]):
            pose[ROLL] = _balanced_roll(parameters, pose, frame_pose, load)
        else:
            pose = _balanced_pose(parameters, pose, frame_pose, limits, load, free)
    elif not _is_held(parameters, pose, frame_pose, limits, load):
        weak = _weak_axes(parameters, pose, frame_pose)
        near = _balanced_pose(parameters, pose, frame_pose, limits, load, weak) if weak else pose
        pose = near if _is_held(parameters, near, frame_pose, limits, load) else pose
    tensions = _hold(parameters, pose, frame_pose, limits, load)
    lengths = geometry(parameters.cables, pose, frame_pose).lengths
    return Equilibrium(pose, tensions, unstretched_lengths(parameters, lengths, tensions))


def _balanced_roll(
    parameters: PlantParameters, bar_pose: Array, frame_pose: ArrayLike, load: Array
) -> float:
    """Return the roll at which gravity and load need no moment that the cables do not give."""
    pose, start = bar_pose.copy(), float(bar_pose[ROLL])

    def imbalance(roll: float) -> float:
        pose[ROLL] = roll
        structure = -geometry(parameters.cables, pose, frame_pose).bar.T
        direction = np.linalg.svd(structure)[0][:, -1]
        return float(direction @ (gravity_wrench(parameters, pose) + load) * np.sign(direction[3]))

    found = scipy.optimize.root_scalar(imbalance, x0=start, x1=start + 1e-3, xtol=1e-14)
    return float(found.root) if found.converged else start


def _balanced_pose(
    parameters: PlantParameters,
    bar_pose: Array,
    frame_pose: ArrayLike,
    limits: Array,
    load: Array,
    free: Sequence[int],
) -> Array:
    """Return the pose near `bar_pose`, changed in its `free` coordinates, that tensions balance.

    Tensions and coordinates are found together, by least squares of what is missing of the wrench.
    """
    count = len(free)
    size = np.linalg.norm(gravity_wrench(parameters, bar_pose) + load) or 1.0
    lever = gyration_radius(parameters)
    scale = np.array([1.0] * 3 + [1.0 / lever] * 3) / size

    def pose_of(unknown: Array) -> Array:
        pose = bar_pose.copy()
        pose[list(free)] = unknown[:count]
        return pose

    def missing(unknown: Array) -> Array:
        pose = pose_of(unknown)
        structure = -geometry(parameters.cables, pose, frame_pose).bar.T
        wrench = gravity_wrench(parameters, pose) + load
        return np.asarray(scale * (structure @ (size * unknown[count:]) + wrench))

    low = np.concatenate([np.full(count, -np.inf), limits[:, 0] / size])
    high = np.concatenate([np.full(count, np.inf), limits[:, 1] / size])
    structure = -geometry(parameters.cables, bar_pose, frame_pose).bar.T
    tensions = least_tensions(structure, -gravity_wrench(parameters, bar_pose) - load, limits)
    start = np.concatenate([bar_pose[list(free)], tensions / size])
    inner = np.clip(start, low + SEARCH_TOLERANCE, high - SEARCH_TOLERANCE)
    found = scipy.optimize.least_squares(
        missing, inner, bounds=(low, high), ftol=None, xtol=SEARCH_TOLERANCE, gtol=SEARCH_TOLERANCE
    )
    return pose_of(found.x)


def unstretched_lengths(parameters: PlantParameters, lengths: Array, tensions: Array) -> Array:
    """Return l0 (n,) [m] at which cables stretched to `lengths` carry `tensions` at rest.

    Raises:
        ConvergenceError: a cable would be stretched to more than twice its length.
    """
    out = np.empty(len(lengths))
    for i, (length, tension) in enumerate(zip(lengths, tensions, strict=True)):
        bounds = (0.5 * length, length)
        args = (length, tension, parameters, i)
        if tension > 0 and _excess_tension(bounds[0], *args) < 0.0:
            raise ConvergenceError(
                f"cable {i}: {tension:.4g} N stretch it to more than twice its length, allowed: a"
                " stiffer cable (youngs_modulus is in Pa, diameter in m)"
            )
        out[i] = (
            scipy.optimize.brentq(_excess_tension, *bounds, args, xtol=1e-15)
            if tension > 0
            else length
        )
    return out


def _excess_tension(
    unstretched: float, length: float, tension: float, parameters: PlantParameters, i: int
) -> float:
    cables, tables = parameters.cables, parameters.tables
    elastic = unstretched + cables[i, OFFSET_LENGTH]
    scale = law_scale(elastic, cables, i)
    found, _ = elastic_tension(length - unstretched, elastic, scale, cables, tables, i)
    return float(found - tension)


def _is_held(
    parameters: PlantParameters, pose: Array, frame_pose: ArrayLike, limits: Array, load: Array
) -> bool:
    """Return whether tensions within the limits hold the bar at a pose."""
    return _nearest(parameters, pose, frame_pose, limits, load)[1] <= RESIDUAL_TOLERANCE


def _nearest(
    parameters: PlantParameters, pose: Array, frame_pose: ArrayLike, limits: Array, load: Array
) -> tuple[Array, float]:
    """Return the tensions within the limits that come closest to rest, and what they miss."""
    structure = -geometry(parameters.cables, pose, frame_pose).bar.T
    wrench = -gravity_wrench(parameters, pose) - load
    tensions = least_tensions(structure, wrench, limits)
    return tensions, _residual(structure, tensions, wrench)


def _weak_axes(parameters: PlantParameters, pose: Array, frame_pose: ArrayLike) -> list[int]:
    """Return the coordinate in which the cables hold the bar a hundred times less than in others.

    None where they hold it in all: then its tensions are at their limits for the load's sake.
    """
    structure = geometry(parameters.cables, pose, frame_pose).bar.T
    directions, sizes, _ = np.linalg.svd(structure)
    if sizes[-1] > _WEAK * sizes[0]:
        return []
    return [int(np.argmax(np.abs(directions[:, -1])))]


def _balanced(parameters: PlantParameters, pose: Array, frame_pose: ArrayLike, load: Array) -> bool:
    structure = -geometry(parameters.cables, pose, frame_pose).bar.T
    wrench = -gravity_wrench(parameters, pose) - load
    tensions = np.linalg.pinv(structure, rcond=RANK_TOLERANCE) @ wrench
    return _residual(structure, tensions, wrench) < WRENCH_TOLERANCE


def _residual(structure: Array, tensions: Array, wrench: Array) -> float:
    weight = np.linalg.norm(wrench) or 1.0  # without gravity: in N
    return float(np.linalg.norm(structure @ tensions - wrench) / weight)


def _hold(
    parameters: PlantParameters, pose: Array, frame_pose: ArrayLike, limits: Array, load: Array
) -> Array:
    tensions, residual = _nearest(parameters, pose, frame_pose, limits, load)
    if residual > RESIDUAL_TOLERANCE:
        place = ", ".join(f"{value:.4g}" for value in pose)
        raise ConvergenceError(
            f"no tensions within the limits hold the bar at rest at [{place}] (m, rad): wrench"
            f" residual {residual:.2g} of the weight"
        )
    return tensions


def least_tensions(structure: Array, wrench: Array, limits: Array) -> Array:
    """Return the tensions (n,) [N] least in norm with structure·t = wrench and limits (n, 2).

    Where none are within the limits: those that come closest to the wrench.

    The pseudo-inverse's solution is normal to the null space, so the least tensions are the least
    distance from it within the null space under linear inequalities, which non-negative least
    squares solves: Lawson, Hanson, Solving Least Squares Problems (1974), chapter 23.

    Raises:
        ConvergenceError: that search did not come to an end.
    """
    low, high = limits[:, 0], limits[:, 1]
    base: Array = np.linalg.pinv(structure, rcond=RANK_TOLERANCE) @ wrench
    null = scipy.linalg.null_space(structure, rcond=RANK_TOLERANCE)
    rows = np.vstack([np.hstack([null.T, -null.T]), np.concatenate([low - base, base - high])])
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    try:
        gap = rows @ scipy.optimize.nnls(rows, goal)[0] - goal
    except RuntimeError as err:
        raise ConvergenceError(f"least tensions within the limits: {err}") from None
    if np.linalg.norm(gap) < RESIDUAL_TOLERANCE:
        return np.asarray(scipy.optimize.lsq_linear(structure, wrench, (low, high), tol=1e-14).x)
    return np.clip(base - null @ (gap[:-1] / gap[-1]), low, high)
