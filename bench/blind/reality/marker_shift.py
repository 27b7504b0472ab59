"""The geometry computed from markers that are displaced from where the file has them.

Attachments and the bar's origin are taken to be beside where they are by the same vector in the
bar's axes, exits are not. All is per metre of shift along the bar's own y, as
`faults.MarkerShift` has it: taken with the shift less without it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Scene

Array = NDArray[np.float64]

_STEP = 1e-5  # [m]


def length_changes(scenes: Sequence[Scene]) -> Array:
    """Return by how much cables are taken to be longer, (times, n) [m/m]."""
    ahead, behind = (np.linalg.norm(_lines(scenes, side * _STEP), axis=2) for side in (0.5, -0.5))
    return np.asarray((ahead - behind) / _STEP)


def tension_changes(scenes: Sequence[Scene], slopes: Array) -> Array:
    """Return by how much cables are taken to pull harder, less its mean, (times, n) [N/m].

    Args:
        scenes: equally spaced.
        slopes: tangent stiffnesses (n,) [N/m].
    """
    changes = length_changes(scenes)
    # The length wound at the start is known to nobody, so that a constant elongation says nothing.
    return np.asarray(slopes * (changes - changes.mean(axis=0)))


def wrench_changes(scenes: Sequence[Scene]) -> Array:
    """Return by how much the tensions' wrench on the bar is taken to be another.

    Force, then moment about the bar's origin, in world axes, (times, 6) [N/m, N]. Arms are the
    same with and without the shift, directions are not.
    """
    ahead, behind = (_wrenches(scenes, side * _STEP) for side in (0.5, -0.5))
    return np.asarray((ahead - behind) / _STEP)


def _lines(scenes: Sequence[Scene], shift: float) -> Array:
    """Return l = attachment − exit with the bar taken to be beside itself, (times, n, 3) [m]."""
    exits, ends = np.split(np.array([scene.ends for scene in scenes]), 2, axis=1)
    across = np.array([scene.rotation[:, 1] for scene in scenes])
    return np.asarray(ends + shift * across[:, None] - exits)


def _wrenches(scenes: Sequence[Scene], shift: float) -> Array:
    """Return −Jᵀ t, (times, 6) [N, N·m]."""
    lines = _lines(scenes, shift)
    tensions = np.array([scene.tensions for scene in scenes])
    forces = -(tensions / np.linalg.norm(lines, axis=2))[:, :, None] * lines
    arms = np.array([scene.ends[len(scene.tensions) :] - scene.body[:3] for scene in scenes])
    return np.concatenate([forces.sum(axis=1), np.cross(arms, forces).sum(axis=1)], axis=1)
