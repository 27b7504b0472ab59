"""How far the bar can be displaced in one DOF at a time, thesis table 6-1."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.pose_grid import Grid

# Which value of a pose each DOF of a grid is.
GRID_AXES = {"surge": 0, "sway": 1, "heave": 2, "pitch": 4, "yaw": 5}
LIMITED = ("surge", "sway", "pitch", "yaw")


def sweep(grid: Grid, dof: str, pose: Sequence[float]) -> Grid:
    """Return the grid's values of one DOF from zero on, all others as in `pose`."""
    fixed = {name: np.array([float(pose[axis])]) for name, axis in GRID_AXES.items()}
    values = grid[list(GRID_AXES).index(dof)]
    fixed[dof] = values[values >= 0.0]
    return Grid(*fixed.values())


def limits(
    holds: Callable[[Grid], NDArray[np.bool_]], grid: Grid, pose: Sequence[float]
) -> dict[str, float | None]:
    """Return the last value of the grid up to which each DOF of `LIMITED` is held [m, rad].

    None where not even the first is.

    Args:
        holds: says at which poses of a grid the bar is held.
        grid: whose values are tried.
        pose: of the bar; its other DOFs stay.
    """
    found: dict[str, float | None] = {}
    for dof in LIMITED:
        line = sweep(grid, dof, pose)
        held = holds(line).ravel()
        count = len(held) if held.all() else int(np.argmin(held))
        values = line[list(GRID_AXES).index(dof)]
        found[dof] = float(values[count - 1]) if count else None
    return found
