"""How far the bar can be displaced in one DOF at a time, thesis table 6-1."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.pose_grid import GRID_AXES, Grid

LIMITED = ("surge", "sway", "pitch", "yaw")


def sweep(grid: Grid, dof: str, pose: Sequence[float]) -> Grid:
    """Return the grid's values of one DOF from zero on, all others as in `pose`.

    From the pose's own value on where that is not among those about zero.
    """
    fixed = {name: np.array([float(pose[axis])]) for name, axis in GRID_AXES.items()}
    values = grid[list(GRID_AXES).index(dof)]
    start = 0.0 if values[0] <= 0.0 <= values[-1] else float(pose[GRID_AXES[dof]])
    fixed[dof] = values[values >= start]
    return Grid(*fixed.values())


def limits(
    holds: Callable[[Grid], NDArray[np.bool_]], grid: Grid, pose: Sequence[float]
) -> dict[str, float | None]:
    """Return the last value of the grid up to which each DOF of `LIMITED` is held [m, rad].

    None where not even the first is, and for a DOF of which the grid has no values to try.

    Args:
        holds: says at which poses of a grid the bar is held.
        grid: whose values are tried.
        pose: of the bar; its other DOFs stay.
    """
    found: dict[str, float | None] = {}
    for dof in LIMITED:
        line = sweep(grid, dof, pose)
        if len(grid[list(GRID_AXES).index(dof)]) == 1:
            found[dof] = None
            continue
        held = holds(line).ravel()
        count = len(held) if held.all() else int(np.argmin(held))
        values = line[list(GRID_AXES).index(dof)]
        found[dof] = float(values[count - 1]) if count else None
    return found
