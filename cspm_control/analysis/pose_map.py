"""What holds, and how well, over a plane of poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.cable_structure import CableStructure, structures, wanted_at_rest
from cspm_control.analysis.manipulability import conditions, mass_columns, measures
from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace import ALGORITHMS, static_workspace
from cspm_control.analysis.wrench_set import WrenchSet, wrench_set
from cspm_model.kernels.machine import PlantParameters
from cspm_model.spanned_axes import gyration_radius

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PoseMap:
    """Numbers per pose of a grid, all (P·Q,), orientations fastest.

    Attributes:
        grid: the poses.
        static: by algorithm of the thesis, whether tensions from 0 hold the bar.
        feasible: whether tensions from their lowest limit do.
        factor: how many times the required acceleration the cables can give, in all directions at
            once; NaN where they cannot hold the bar.
        condition: κ of (6-11).
        measure: of manipulability.
    """

    grid: Grid
    static: dict[str, Mask]
    feasible: Mask
    factor: Array
    condition: Array
    measure: Array


def pose_map(
    machine: CableStructure, parameters: PlantParameters, grid: Grid, acceleration: Array
) -> PoseMap:
    """Return the map of a grid; `acceleration` (6,) is required either way [m/s², rad/s²]."""
    structure = structures(machine, grid)
    wrenches = feasible_wrenches(machine, grid)
    return PoseMap(
        grid=grid,
        static={name: static_workspace(machine, grid, name).ravel() for name in ALGORITHMS},
        feasible=wrenches.holds,
        factor=wrenches.factor(required_edges(machine, parameters, grid, acceleration)),
        condition=conditions(structure),
        measure=measures(machine, structure, gyration_radius(parameters)),
    )


def feasible_wrenches(machine: CableStructure, grid: Grid) -> WrenchSet:
    """Return the wrenches that tensions within their limits can give around rest."""
    count = len(grid.positions)
    wanted = np.tile(wanted_at_rest(machine, grid), (count, 1))
    return wrench_set(structures(machine, grid), machine.limits, wanted)


def required_edges(
    machine: CableStructure, parameters: PlantParameters, grid: Grid, acceleration: Array
) -> Array:
    """Return half the edges of the box of wrenches, (P·Q, m, m), that accelerations ± need."""
    rows = np.asarray(acceleration, dtype=float)[list(machine.axes)]
    return mass_columns(machine, parameters, grid) * rows
