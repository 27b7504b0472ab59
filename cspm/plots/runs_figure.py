"""The figure of several runs side by side: errors within the requirement, tensions per group."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cspm.plots.picture_style import save
from cspm.plots.run_panels import binned, draw_errors, draw_tensions
from cspm_control.analysis.cable_groups import cable_groups
from cspm_msgs_py.scenario import Requirement
from cspm_run.run_result import RunResult

Array = NDArray[np.float64]

ERRORS = ("position error [mm]", "angle error [mrad]")


def draw_runs(
    path: Path,
    results: Sequence[RunResult],
    requirement: Requirement,
    cables: Sequence[str],
    periods: Sequence[float],
) -> None:
    """Write the figure of several runs as PNG, a column each, rows to the same scale.

    Envelopes are drawn, so that no spike is lost. Roll is left out: a bar whose cables cannot turn
    it about its own axis follows nothing there.

    Args:
        path: where to.
        results: the runs.
        requirement: drawn as a band.
        cables: names, in the order of the tensions.
        periods: of each run's plant [s].
    """
    groups = cable_groups(cables)
    labels = [*ERRORS, *(f"{name} [N]" for name in groups)]
    heights = [2.0, 2.0, *(1.0 for _ in groups)]
    figure = Figure(figsize=(6.5 * len(results), 1.3 * sum(heights)), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(
        len(labels), len(results), sharex=True, sharey="row", squeeze=False, height_ratios=heights
    )
    for column, (result, period) in enumerate(zip(results, periods, strict=True)):
        _draw_run(grid[:, column], result, requirement, groups, period)
    for row, label in enumerate(labels):
        grid[row, 0].set_ylabel(label)
    for row in range(len(ERRORS)):
        grid[row, -1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    save(figure, path)


def _draw_run(
    rows: NDArray[np.object_],
    result: RunResult,
    requirement: Requirement,
    groups: Mapping[str, Sequence[int]],
    period: float,
) -> None:
    time, envelope = binned(result.statistics, period)
    thousandths: Array = 1e3 * envelope
    draw_errors(rows[0], time, thousandths, (0, 1, 2), 1e3 * requirement.position)
    draw_errors(rows[1], time, thousandths, (4, 5), 1e3 * requirement.angle)
    for axes, members in zip(rows[len(ERRORS) :], groups.values(), strict=True):
        draw_tensions(axes, time, envelope, members)
    rows[0].set_title(f"{result.scenario}, seed {result.seed}")
    rows[-1].set_xlabel("time [s]")
