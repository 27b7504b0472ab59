"""How cables pull on the bar over many poses: the structure matrices −Jᵀ of (2-13)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace_kernels import POINT, all_structures
from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels.cable import ATTACHMENT, EXIT, PARTS, PULLEY_RADIUS
from cspm_model.parameters import nominal_parameters
from cspm_model.spanned_axes import spanned_axes, structures_at
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


class CableStructure(NamedTuple):
    """A machine as far as statics go, its winch frame at the origin.

    Attributes:
        axes: rows of the wrench that the cables are to meet: those that they give independently.
        outlets: where cables leave the frame, (n, OUTLET_COLUMNS) of `workspace_kernels`.
        attachments: (n, 3) in bar_ned [m].
        limits: tensions (n, 2) [N].
        weight: of the bar [N].
        com: its centre of mass in bar_ned [m].
    """

    axes: tuple[int, ...]
    outlets: Array
    attachments: Array
    limits: Array
    weight: float
    com: Array

    @property
    def exits(self) -> Array:
        """The points of the outlets, (n, 3) [m]."""
        return self.outlets[:, POINT : POINT + 3]


def cable_structure(testbed: Testbed, pose: ArrayLike) -> CableStructure:
    """Return what a machine exerts; `pose` is where its rank is counted.

    Raises:
        InputError: no bar, or cables that give no force.
    """
    if testbed.bar is None:
        raise InputError("analysis: this test-bed has no bar, allowed: a test-bed with a bar")
    parameters = nominal_parameters(testbed)
    cables, bar = parameters.cables, parameters.bar
    place = np.array([pose], dtype=float)
    axes = spanned_axes(structures_at(parameters, place, np.zeros((1, 6))))
    if not axes:
        raise InputError(
            f"analysis: {len(cables)} cables give no force at this pose, allowed: a machine and a"
            " pose whose cables do"
        )
    return CableStructure(
        axes,
        np.hstack([cables[:, EXIT : EXIT + 3], cables[:, PULLEY_RADIUS : PARTS + 1]]),
        cables[:, ATTACHMENT : ATTACHMENT + 3],
        np.array([cable.tension_limits for cable in testbed.cables], dtype=float),
        float(bar[bar_kernel.MASS] * bar[bar_kernel.GRAVITY]),
        bar[bar_kernel.COM : bar_kernel.COM + 3].copy(),
    )


def structures(machine: CableStructure, grid: Grid) -> Array:
    """Return −Jᵀ, rows `machine.axes`, at all poses of a grid, (P·Q, m, n).

    Orientations are fastest. NaN where a cable has no direction, as inside its pulley.
    """
    arms = np.ascontiguousarray(np.einsum("qij,nj->qni", grid.rotations, machine.attachments))
    out = np.empty((grid.size, len(machine.axes), len(machine.outlets)))
    all_structures(grid.positions, arms, machine.outlets, np.array(machine.axes), out)
    return out


def wanted_at_rest(machine: CableStructure, grid: Grid) -> Array:
    """Return what the cables have to exert against gravity per orientation, (Q, m) [N, N·m]."""
    force = np.array([0.0, 0.0, -machine.weight])
    moments = np.cross(grid.rotations @ machine.com, force)
    wrench = np.hstack([np.broadcast_to(force, moments.shape), moments])
    return np.ascontiguousarray(wrench[:, list(machine.axes)])
