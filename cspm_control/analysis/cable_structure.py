"""How cables pull on the bar over many poses: the structure matrices −Jᵀ of (2-13)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.analysis.pose_grid import Grid
from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.kinematics import RANK_TOLERANCE, geometry
from cspm_model.linearisation import ALL_AXES
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


class CableStructure(NamedTuple):
    """A machine as far as statics go, its winch frame at the origin.

    Attributes:
        axes: rows of the wrench that the cables are to meet: all, or all but roll where they span
            no more.
        exits: (n, 3), [m].
        attachments: (n, 3) in bar_ned [m].
        limits: tensions (n, 2) [N].
        weight: of the bar [N].
        com: its centre of mass in bar_ned [m].
    """

    axes: tuple[int, ...]
    exits: Array
    attachments: Array
    limits: Array
    weight: float
    com: Array


def cable_structure(testbed: Testbed, pose: ArrayLike) -> CableStructure:
    """Return what a machine exerts; `pose` is where its rank is counted.

    Raises:
        InputError: no bar, or the cables span too few directions of a wrench.
    """
    if testbed.bar is None:
        raise InputError("workspace: this test-bed has no bar, allowed: a test-bed with a bar")
    parameters = nominal_parameters(testbed)
    cables, bar = parameters.cables, parameters.bar
    jacobian = geometry(cables, pose, np.zeros(6)).bar
    for axes in (ALL_AXES, CONTROLLED_AXES):
        if np.linalg.matrix_rank(jacobian[:, list(axes)], rtol=RANK_TOLERANCE) == len(axes):
            break
    else:
        raise InputError(
            f"workspace: {len(cables)} cables do not span every force and moment but roll,"
            " allowed: a machine whose cables do"
        )
    return CableStructure(
        axes,
        np.ascontiguousarray(cables[:, EXIT : EXIT + 3]),
        cables[:, ATTACHMENT : ATTACHMENT + 3],
        np.array([cable.tension_limits for cable in testbed.cables], dtype=float),
        float(bar[bar_kernel.MASS] * bar[bar_kernel.GRAVITY]),
        bar[bar_kernel.COM : bar_kernel.COM + 3].copy(),
    )


def structures(machine: CableStructure, grid: Grid) -> Array:
    """Return −Jᵀ, rows `machine.axes`, at all poses of a grid, (P·Q, m, n).

    Orientations are fastest.
    """
    arms = np.einsum("qij,nj->qni", grid.rotations, machine.attachments)
    spans = grid.positions[:, None, None, :] + arms - machine.exits
    pulls = -spans / np.linalg.norm(spans, axis=-1, keepdims=True)
    rows = np.concatenate([pulls, np.cross(np.broadcast_to(arms, pulls.shape), pulls)], axis=-1)
    every = np.swapaxes(rows, -1, -2)[..., list(machine.axes), :]
    return every.reshape(-1, *every.shape[-2:])


def wanted_at_rest(machine: CableStructure, grid: Grid) -> Array:
    """Return what the cables have to exert against gravity per orientation, (Q, m) [N, N·m]."""
    force = np.array([0.0, 0.0, -machine.weight])
    moments = np.cross(grid.rotations @ machine.com, force)
    wrench = np.hstack([np.broadcast_to(force, moments.shape), moments])
    return np.ascontiguousarray(wrench[:, list(machine.axes)])
