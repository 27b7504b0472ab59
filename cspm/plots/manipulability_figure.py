"""The figure of manipulability: ellipses over the workspace, accelerations along the depth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from cspm.plots.picture_style import save
from cspm_control.analysis.cable_structure import CableStructure, structures
from cspm_control.analysis.manipulability import available_accelerations
from cspm_control.analysis.pose_grid import Grid, both_ways
from cspm_model.kernels.machine import PlantParameters

Array = NDArray[np.float64]

# Scale of the force ellipses, each drawn at its pose: per N/N, of the range of poses.
SIZE = 0.3
TURN = np.linspace(0.0, 2.0 * np.pi, 97)
DOWN, UP = ":", "-"


def draw_manipulability(
    path: Path,
    machine: CableStructure,
    parameters: PlantParameters,
    pose: Sequence[float],
    grid: Grid,
) -> None:
    """Write force ellipses in two planes, and the possible accelerations from rest over depth.

    Over the ranges of a `grid` of poses.
    """
    figure = Figure(figsize=(13, 8), layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplot_mosaic(
        [["top", "side", "linear"], ["top", "side", "angular"]], width_ratios=[1.0, 0.5, 1.1]
    )
    top, side, linear, angular = (places[name] for name in ("top", "side", "linear", "angular"))
    across, depths = _spread(both_ways(grid.x), 3), _spread(grid.z, 5)
    _ellipses(top, machine, pose, (0, 1), across, _spread(both_ways(grid.y), 3))
    top.set(xlabel="surge [m]", ylabel="sway [m]", title="force for |t| = 1 N, from above")
    _ellipses(side, machine, pose, (0, 2), across, depths)
    side.set(xlabel="surge [m]", ylabel="heave, down [m]", title="from the side")
    side.invert_yaxis()
    _accelerations(linear, angular, machine, parameters, pose, grid.z)
    save(figure, path)


def _spread(values: Array, count: int) -> Array:
    """Return values within a range, as many to each end as there are between two of them."""
    low, high = float(values[0]), float(values[-1])
    return low + (high - low) * (np.arange(count) + 0.5) / count


def _ellipses(
    axes: Axes,
    machine: CableStructure,
    pose: Sequence[float],
    plane: tuple[int, int],
    places: Array,
    heights: Array,
) -> None:
    circle = np.array([np.cos(TURN), np.sin(TURN)])
    size = SIZE * (float(np.ptp(places)) or 1.0)
    for across in places:
        for height in heights:
            values = [np.array([pose[axis]]) for axis in (0, 1, 2, 4, 5)]
            values[plane[0]], values[plane[1]] = np.array([across]), np.array([height])
            pulls = structures(machine, Grid(*values))[0]
            if np.isnan(pulls).any():
                continue
            rows = [pulls[machine.axes.index(axis)] for axis in plane if axis in machine.axes]
            left, lengths, _ = np.linalg.svd(np.array([*rows, *[0.0 * pulls[0]] * (2 - len(rows))]))
            x, y = size * (left * lengths) @ circle
            axes.plot(across + x, height + y, color="tab:blue", linewidth=1.0)
            axes.plot(across, height, "k.", markersize=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xticks(places)
    axes.grid(alpha=0.3)


def _accelerations(
    linear: Axes,
    angular: Axes,
    machine: CableStructure,
    parameters: PlantParameters,
    pose: Sequence[float],
    depths: Array,
) -> None:
    found = [
        available_accelerations(machine, parameters, (*pose[:2], depth, *pose[3:]))
        for depth in depths
    ]
    for dof in found[0]:
        axes = angular if dof in ("roll", "pitch", "yaw") else linear
        both = np.array([each[dof] for each in found])
        lines = axes.semilogy(depths, both[:, 1], UP, label=f"{dof}, along its axis")
        if not np.allclose(both[:, 0], both[:, 1], equal_nan=True):
            axes.semilogy(
                depths, both[:, 0], DOWN, color=lines[0].get_color(), label=f"{dof}, against"
            )
    for axes, unit in ((linear, "m/s²"), (angular, "rad/s²")):
        axes.set(xlabel="heave, down [m]", ylabel=f"largest acceleration from rest [{unit}]")
        axes.grid(alpha=0.3, which="both")
        if not axes.lines or not any(
            np.any(np.asarray(line.get_ydata()) > 0.0) for line in axes.lines
        ):
            axes.set_yscale("linear")
            continue
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.legend(fontsize="small")
