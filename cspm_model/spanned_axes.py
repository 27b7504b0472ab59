"""Which forces and moments the cables of a machine can exert, each on its own, over some poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import geometry

Array = NDArray[np.float64]

# Axes are taken in this order, each where the cables give it beside those before: forces first,
# roll last, as the bar of the thesis has its attachments on its roll axis.
ORDER = (0, 1, 2, 5, 4, 3)
# A unit wrench along an axis needs tensions whose norm is the reciprocal of the axis's share. At
# less than this share they are twenty times those of cables that pull in all directions alike, and
# a load cell's error of 1 % of the tension is a fifth of the wrench.
LEAST_SHARE = 0.05


def gyration_radius(parameters: PlantParameters) -> float:
    """Return √(tr(I)/2m) of the bar [m], which makes moments comparable to forces."""
    bar = parameters.bar
    inertia = bar[bar_kernel.INERTIA : bar_kernel.INERTIA + 9].reshape(3, 3)
    return float(np.sqrt(np.trace(inertia) / (2.0 * bar[bar_kernel.MASS])))


def structures_at(parameters: PlantParameters, bar_poses: Array, frame_poses: Array) -> Array:
    """Return −Jᵀ of (2-13), moments over the bar's radius of gyration, (k, 6, n).

    Args:
        parameters: of a machine with a bar.
        bar_poses: x y z φ θ ψ in world_ned, (k, 6) [m, rad].
        frame_poses: the winch frame's, (k, 6).

    Raises:
        SingularityError: an exit and its attachment coincide.
    """
    scale = np.array([1.0] * 3 + [1.0 / gyration_radius(parameters)] * 3)
    pairs = zip(bar_poses, frame_poses, strict=True)
    return np.array(
        [-scale[:, None] * geometry(parameters.cables, bar, frame).bar.T for bar, frame in pairs]
    )


def spanned_axes(structures: Array, first: Sequence[int] = ()) -> tuple[int, ...]:
    """Return the wrench axes, 0 to 5, that the cables give independently at every pose, sorted.

    Args:
        structures: of `structures_at`, (k, 6, n).
        first: axes that are taken before all others.
    """
    order = [*first, *(axis for axis in ORDER if axis not in first)]
    found: list[int] = []
    for axis in order:
        if share_of(structures, axis, found) >= LEAST_SHARE:
            found.append(axis)
    return tuple(sorted(found))


def share_of(structures: Array, axis: int, beside: Sequence[int]) -> float:
    """Return the least share, over the poses, of an axis that is independent of those `beside`.

    1 is what n cables that pull in all directions alike give along each of three axes, √(n/3).
    """
    rows = structures[:, axis]
    basis, _ = np.linalg.qr(np.swapaxes(structures[:, list(beside)], 1, 2))
    inside = np.einsum("kni,kn->ki", basis, rows)
    rest = rows - np.einsum("kni,ki->kn", basis, inside)
    return float(np.linalg.norm(rest, axis=1).min() / np.sqrt(structures.shape[2] / 3.0))
