"""The workspace of a machine: limits, whole grids, maps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.cable_structure import CableStructure, cable_structure, structures
from cspm_control.analysis.manipulability import conditions
from cspm_control.analysis.pose_grid import GRID_AXES, Grid, both_ways, workspace_grids
from cspm_control.analysis.pose_map import PoseMap, feasible_wrenches, pose_map, required_edges
from cspm_control.analysis.workspace import ALGORITHMS, static_workspace
from cspm_control.analysis.workspace_limits import limits
from cspm_model.kernels.machine import PlantParameters
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEASIBLE, ACCELERATED = "wrench_feasible", "accelerated"
TRANSLATION, ROTATION = "translation", "rotation"


class WholeGrid(NamedTuple):
    """What an algorithm found over its whole grid.

    Attributes:
        poses: how many were tried.
        held: how many of them are held.
        largest: the farthest value of each DOF at which any pose is held [m, rad]; none: empty.
        ends: the farthest value of each DOF of which several were tried [m, rad].
    """

    poses: int
    held: int
    largest: dict[str, float]
    ends: dict[str, float]


@dataclass(frozen=True, eq=False)
class WorkspaceResult:
    """Everything about the workspace around one pose.

    Attributes:
        pose: the one.
        acceleration: required, either way, (6,) [m/s², rad/s²].
        factor: how many times that the cables can give at the pose; NaN where they cannot hold
            the bar, infinite where nothing is required.
        limits: per way of counting, how far each DOF goes alone [m, rad].
        whole: per algorithm.
        largest_condition: max κ over what Algorithm 2 holds, translation and rotation by itself;
            none where it holds nothing.
        translation: surge × sway × heave at the pose's orientation: what each algorithm holds.
        maps: planes through the pose.
    """

    pose: tuple[float, ...]
    acceleration: Array
    factor: float
    limits: dict[str, dict[str, float | None]]
    whole: dict[str, WholeGrid]
    largest_condition: dict[str, float]
    translation: tuple[Grid, dict[str, Mask]]
    maps: dict[str, PoseMap]


def analyse_workspace(
    testbed: Testbed,
    pose: Sequence[float],
    acceleration: Array,
    coarse: int,
    advance: Callable[[str, int], None],
    stopped: Callable[[], bool],
) -> WorkspaceResult | None:
    """Return the workspace around a pose; None where it was stopped.

    Args:
        testbed: the machine.
        pose: x y z φ θ ψ of the bar [m, rad]; its roll is taken as 0.
        acceleration: required either way, (6,) [m/s², rad/s²].
        coarse: take every so-manieth value of each DOF of the whole grids.
        advance: called per algorithm with how many more poses of its whole grid are done.
        stopped: says whether to give up.

    Raises:
        InputError: no bar, or the cables span too few directions.
    """
    machine, parameters = cable_structure(testbed, pose), nominal_parameters(testbed)
    grids = workspace_grids(testbed.name, machine.exits, machine.axes, pose)
    whole = {}
    for name in ALGORITHMS:
        grid = grids[name].every(coarse)
        held = static_workspace(machine, grid, name, partial(advance, name), stopped)
        whole[name] = _whole(grid, held)
    if stopped():
        return None
    fine = grids["general"]
    around = _around(pose, x=both_ways(fine.x), y=both_ways(fine.y), z=fine.z)
    return WorkspaceResult(
        pose=tuple(pose),
        acceleration=acceleration,
        factor=float(_factors(machine, parameters, _around(pose), acceleration)[0]),
        limits=_limits(machine, parameters, pose, acceleration, grids),
        whole=whole,
        largest_condition=_largest_conditions(machine, pose, fine),
        translation=(
            around,
            {name: static_workspace(machine, around, name) for name in ALGORITHMS},
        ),
        maps={
            name: pose_map(machine, parameters, plane, acceleration)
            for name, plane in planes(pose, fine).items()
        },
    )


def planes(pose: Sequence[float], fine: Grid) -> dict[str, Grid]:
    """Return the planes through a pose that are mapped, by the names of their DOFs.

    Only those in which both DOFs of the grid `fine` have several values.
    """
    x, y = both_ways(fine.x), both_ways(fine.y)
    found = {
        "surge, sway": _around(pose, x=x, y=y),
        "surge, heave": _around(pose, x=x, z=fine.z),
        "pitch, yaw": _around(pose, pitch=both_ways(fine.pitch), yaw=both_ways(fine.yaw)),
    }
    return {name: plane for name, plane in found.items() if sum(n > 1 for n in plane.shape) == 2}


def _around(pose: Sequence[float], **values: Array) -> Grid:
    one = Grid(*(np.array([float(pose[axis])]) for axis in GRID_AXES.values()))
    return one._replace(**values)


def _whole(grid: Grid, held: Mask) -> WholeGrid:
    largest = {}
    for axis, dof in enumerate(GRID_AXES):
        others = tuple(k for k in range(len(GRID_AXES)) if k != axis)
        values = np.abs(grid[axis][held.any(axis=others)])
        if len(values):
            largest[dof] = float(values.max())
    tried = {dof: grid[axis] for axis, dof in enumerate(GRID_AXES) if len(grid[axis]) > 1}
    ends = {dof: float(np.abs(values).max()) for dof, values in tried.items()}
    return WholeGrid(grid.size, int(held.sum()), largest, ends)


def _limits(
    machine: CableStructure,
    parameters: PlantParameters,
    pose: Sequence[float],
    acceleration: Array,
    grids: dict[str, Grid],
) -> dict[str, dict[str, float | None]]:
    def accelerated(grid: Grid) -> Mask:
        return np.asarray(_factors(machine, parameters, grid, acceleration) >= 1.0)

    ways: dict[str, Callable[[Grid], Mask]] = {
        name: partial(static_workspace, machine, algorithm=name) for name in ALGORITHMS
    }
    ways[FEASIBLE] = lambda grid: feasible_wrenches(machine, grid).holds
    ways[ACCELERATED] = accelerated
    fine = grids["general"]
    return {name: limits(holds, grids.get(name, fine), pose) for name, holds in ways.items()}


def _factors(
    machine: CableStructure, parameters: PlantParameters, grid: Grid, acceleration: Array
) -> Array:
    edges = required_edges(machine, parameters, grid, acceleration)
    return feasible_wrenches(machine, grid).factor(edges)


def _largest_conditions(
    machine: CableStructure, pose: Sequence[float], fine: Grid
) -> dict[str, float]:
    slices = {
        TRANSLATION: _around(pose, x=fine.x, y=fine.y, z=fine.z),
        ROTATION: _around(pose, pitch=fine.pitch, yaw=fine.yaw),
    }
    found = {}
    for name, grid in slices.items():
        held = static_workspace(machine, grid, "general").ravel()
        if held.any():
            found[name] = float(conditions(structures(machine, grid))[held].max())
    return found
