"""Figures of a workspace: the feasible poses of the bar, and performance measures over them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from cspm.plots.picture_style import save
from cspm_control.analysis.pose_grid import GRID_AXES, Grid
from cspm_control.analysis.pose_map import PoseMap
from cspm_control.analysis.workspace_result import WorkspaceResult

Array = NDArray[np.float64]

# Solid, so that what lies above has the colour of the legend.
COLOURS = {"general": "#8fb8dc", "pseudo_inverse": "#f2d16b"}
LABELS = {"general": "any tensions from 0", "pseudo_inverse": "pseudo-inverse, from 0"}
TIGHTER = (("tab:green", "from t_min"), ("tab:red", "from t_min, accelerating"))
UNITS = dict.fromkeys(("surge", "sway", "heave"), "m") | dict.fromkeys(("pitch", "yaw"), "rad")


def draw_workspace(path: Path, found: WorkspaceResult) -> None:
    """Write the workspace in translation, in 3-D, and the planes through the pose."""
    figure = Figure(figsize=(13, 8), layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplot_mosaic(
        [["space", name] for name in found.maps],
        width_ratios=[1.6, 1.0],
        per_subplot_kw={"space": {"projection": "3d"}},
    )
    _space(places["space"], *found.translation)
    for name, each in found.maps.items():
        _plane(places[name], each)
    handles = [Patch(color=COLOURS[name], label=LABELS[name]) for name in COLOURS]
    handles += [Patch(fill=False, edgecolor=colour, label=label) for colour, label in TIGHTER]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    save(figure, path)


def draw_maps(path: Path, found: WorkspaceResult) -> None:
    """Write κ, manipulability and the factor of the required acceleration over the planes."""
    figure = Figure(figsize=(14, 10), layout="constrained")
    FigureCanvasAgg(figure)
    columns = (
        ("κ of the structure matrix", "condition"),
        ("manipulability √det(S·Sᵀ)", "measure"),
        ("required acceleration, times", "factor"),
    )
    axes = figure.subplots(len(found.maps), len(columns), squeeze=False)
    for row, each in zip(axes, found.maps.values(), strict=True):
        for place, (title, name) in zip(row, columns, strict=True):
            held = np.where(each.static["general"], getattr(each, name), np.nan)
            _map(place, each, held, title)
    save(figure, path)


def _space(
    axes: Any,  # noqa: ANN401 - 3-D axes, which matplotlib leaves untyped
    grid: Grid,
    held: dict[str, NDArray[np.bool_]],
) -> None:
    shape = tuple(len(values) for values in (grid.x, grid.y, grid.z))
    if min(shape) == 1:
        axes.set_axis_off()  # a machine in a plane, which its maps show
        return
    # The deepest first, since what is drawn later lies on top.
    for depth, z in reversed(list(enumerate(grid.z))):
        for name, alpha in (("general", 0.15), ("pseudo_inverse", 0.9)):
            layer = held[name].reshape(shape)[:, :, depth].T.astype(float)
            if layer.any():
                style = {"levels": [0.5, 1.5], "colors": [COLOURS[name]], "alpha": alpha}
                axes.contourf(grid.x, grid.y, layer, zdir="z", offset=z, **style)
    axes.set_xlim(grid.x[0], grid.x[-1])
    axes.set_ylim(grid.y[0], grid.y[-1])
    axes.set_zlim(grid.z[0], grid.z[-1])
    axes.invert_zaxis()
    axes.set_xlabel("surge [m]")
    axes.set_ylabel("sway [m]")
    axes.set_zlabel("heave, down [m]")
    axes.set_box_aspect((1, 1, 1.6))


def _plane(axes: Axes, each: PoseMap) -> None:
    across, up = _two(each.grid)
    shape = len(each.grid[across]), len(each.grid[up])
    values = each.grid[across], each.grid[up]
    for name, colour in COLOURS.items():
        mask = each.static[name].reshape(shape).T.astype(float)
        axes.contourf(*values, mask, levels=[0.5, 1.5], colors=[colour])
    for mask, (colour, _) in zip((each.feasible, each.factor >= 1.0), TIGHTER, strict=True):
        drawn = mask.reshape(shape).T.astype(float)
        if 0.0 < drawn.mean() < 1.0:
            axes.contour(*values, drawn, levels=[0.5], colors=[colour])
    _label(axes, across, up)


def _map(axes: Axes, each: PoseMap, values: Array, title: str) -> None:
    across, up = _two(each.grid)
    shape = len(each.grid[across]), len(each.grid[up])
    shown = np.where(np.isfinite(values), values, np.nan).reshape(shape).T
    axes.set_title(title, fontsize="medium")
    _label(axes, across, up)
    if np.isnan(shown).all():
        axes.text(0.5, 0.5, "nothing to show", transform=axes.transAxes, ha="center")
        return
    mesh = axes.pcolormesh(each.grid[across], each.grid[up], shown, shading="nearest")
    axes.figure.colorbar(mesh, ax=axes)
    if title.startswith("required"):
        drawn = np.nan_to_num(shown, nan=0.0)
        if drawn.min() < 1.0 < drawn.max():
            axes.contour(each.grid[across], each.grid[up], drawn, levels=[1.0], colors=["tab:red"])


def _two(grid: Grid) -> tuple[int, int]:
    """Return the two DOFs that vary in a plane."""
    first, second = (i for i, values in enumerate(grid) if len(values) > 1)
    return first, second


def _label(axes: Axes, across: int, up: int) -> None:
    names = list(GRID_AXES)
    axes.set_xlabel(f"{names[across]} [{UNITS[names[across]]}]")
    axes.set_ylabel(f"{names[up]} [{UNITS[names[up]]}]")
    if names[up] == "heave":
        axes.invert_yaxis()
