"""The figure of a run: pose errors in the requirement's band, and tensions per group of cables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cspm.plots.picture_style import large_letters, save
from cspm.plots.run_panels import binned, draw_errors, draw_tensions
from cspm_control.analysis.cable_groups import cable_groups
from cspm_msgs_py.scenario import Requirement
from cspm_run.run_result import RunResult

Array = NDArray[np.float64]

_ERRORS = ("position error\n[mm]", "angle error\n[mrad]")


def draw_run(
    path: Path,
    result: RunResult,
    requirement: Requirement,
    cables: Sequence[str],
    period: float,
) -> None:
    """Write the figure of a run as PNG: the envelope of every signal, so that no spike is lost.

    Args:
        path: where to.
        result: the run.
        requirement: drawn as a band into the errors.
        cables: names, in the order of the tensions.
        period: the plant's period [s].
    """
    groups = cable_groups(cables)
    labels = list(_ERRORS) * result.has_bar + [f"{kind.replace('_', ' ')}\n[N]" for kind in groups]
    heights = [2.0, 2.0] * result.has_bar + [1.0] * len(groups)
    with large_letters():
        figure = Figure(figsize=(12, 1.6 * sum(heights) + 1.2), layout="constrained")
        FigureCanvasAgg(figure)
        rows = figure.subplots(len(labels), 1, sharex=True, squeeze=False, height_ratios=heights)[
            :, 0
        ]
        _fill(list(rows), result, requirement, list(groups.values()), period)
        for axes, label in zip(rows, labels, strict=True):
            axes.set_ylabel(label)
        rows[-1].set_xlabel("time [s]")
        figure.suptitle(f"{result.scenario}, seed {result.seed}")
        save(figure, path)


def _fill(
    rows: Sequence[Axes],
    result: RunResult,
    requirement: Requirement,
    groups: Sequence[Sequence[int]],
    period: float,
) -> None:
    time, envelope = binned(result.statistics, period)
    if result.has_bar:
        thousandths: Array = 1e3 * envelope
        draw_errors(rows[0], time, thousandths, (0, 1, 2), 1e3 * requirement.position)
        draw_errors(rows[1], time, thousandths, (3, 4, 5), 1e3 * requirement.angle)
        for axes in rows[:2]:
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for axes, members in zip(rows[len(rows) - len(groups) :], groups, strict=True):
        low, high = draw_tensions(axes, time, envelope, members)
        if len(time):
            extent = f"{low.min():.3g} to {high.max():.3g} N"
            axes.text(1.01, 0.5, extent, transform=axes.transAxes, va="center")
