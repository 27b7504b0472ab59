"""The figure of a run: pose errors and tensions over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario import Requirement
from cspm_run.run_result import RunResult

Array = NDArray[np.float64]


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
        requirement: limits drawn into the errors.
        cables: names, in the order of the tensions.
        period: the plant's period [s].
    """
    has_bar = result.has_bar
    used = -(-result.statistics.steps // result.statistics.bin_steps)
    envelope = result.statistics.envelope[:used]
    thousandths: Array = 1e3 * envelope
    time = np.arange(used, dtype=np.float64) * (result.statistics.bin_steps * period)
    figure = Figure(figsize=(11, 9 if has_bar else 4), layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(3 if has_bar else 1, 1, sharex=True, squeeze=False)[:, 0]
    if has_bar:
        _errors(rows[0], time, thousandths[:, :, :3], DOFS[:3], 1e3 * requirement.position, "mm")
        _errors(rows[1], time, thousandths[:, :, 3:6], DOFS[3:], 1e3 * requirement.angle, "mrad")
    for i, name in enumerate(cables):
        _band(rows[-1], time, envelope[:, :, 6 + i], name)
    rows[-1].set_ylabel("tension [N]")
    rows[-1].set_xlabel("time [s]")
    rows[-1].legend(loc="upper right", ncols=4, fontsize="small")
    rows[0].set_title(f"{result.scenario}, seed {result.seed}")
    figure.savefig(path, dpi=110)


def _errors(
    axes: Axes, time: Array, bands: Array, names: Sequence[str], limit: float, unit: str
) -> None:
    for i, name in enumerate(names):
        _band(axes, time, bands[:, :, i], name)
    for side in (-limit, limit):
        label = "required" if side > 0 else None
        axes.axhline(side, color="black", linestyle="--", linewidth=0.8, label=label)
    axes.set_ylabel(f"reference − pose [{unit}]")
    axes.legend(loc="upper right", ncols=4, fontsize="small")


def _band(axes: Axes, time: Array, band: Array, name: str) -> None:
    axes.fill_between(time, band[:, 0], band[:, 1], label=name, alpha=0.8, linewidth=1.0)
    axes.grid(alpha=0.3)
    axes.margins(x=0)
