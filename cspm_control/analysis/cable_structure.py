"""How cables pull on the bar over many poses: the structure matrices −Jᵀ of (2-13)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace_kernels import all_structures
from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.parameters import nominal_parameters
from cspm_model.spanned_axes import spanned_axes, structures_at
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


class CableStructure(NamedTuple):
    """A machine as far as statics go, its winch frame at the origin.

    Attributes:
        axes: rows of the wrench that the cables are to meet: those that they give independently.
        cables: parameter rows, (n, CABLE_COLUMNS) of `cspm_model.kernels.cable`.
        limits: tensions (n, 2) [N].
        weight: of the bar [N].
        com: its centre of mass in bar_ned [m].
    """

    axes: tuple[int, ...]
    cables: Array
    limits: Array
    weight: float
    com: Array

    @property
    def exits(self) -> Array:
        """Where cables leave the frame, (n, 3) [m]."""
        return self.cables[:, EXIT : EXIT + 3]

    @property
    def attachments(self) -> Array:
        """Where they meet the bar first, (n, 3) in bar_ned [m]."""
        return self.cables[:, ATTACHMENT : ATTACHMENT + 3]

    def bodies(self, grid: Grid) -> tuple[Array, Array, Array]:
        """Return a grid's positions (P, 3), rotations row by row (Q, 9), and arms (Q, n, 3) [m].

        Arms run from the bar's origin to the attachments, in world axes.
        """
        arms = np.ascontiguousarray(np.einsum("qij,nj->qni", grid.rotations, self.attachments))
        return grid.positions, np.ascontiguousarray(grid.rotations).reshape(-1, 9), arms


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
        cables,
        np.array([cable.tension_limits for cable in testbed.cables], dtype=float),
        float(bar[bar_kernel.MASS] * bar[bar_kernel.GRAVITY]),
        bar[bar_kernel.COM : bar_kernel.COM + 3].copy(),
    )


def structures(machine: CableStructure, grid: Grid) -> Array:
    """Return −Jᵀ, rows `machine.axes`, at all poses of a grid, (P·Q, m, n).

    Orientations are fastest. NaN where a cable has no direction, as inside its pulley.
    """
    out = np.empty((grid.size, len(machine.axes), len(machine.cables)))
    all_structures(*machine.bodies(grid), machine.cables, np.array(machine.axes), out)
    return out


def wanted_at_rest(machine: CableStructure, grid: Grid) -> Array:
    """Return what the cables have to exert against gravity per orientation, (Q, m) [N, N·m]."""
    force = np.array([0.0, 0.0, -machine.weight])
    moments = np.cross(grid.rotations @ machine.com, force)
    wrench = np.hstack([np.broadcast_to(force, moments.shape), moments])
    return np.ascontiguousarray(wrench[:, list(machine.axes)])
