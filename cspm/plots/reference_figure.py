"""The figure of what a reference needs: tensions, motor speeds and torques over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cspm.plots.picture_style import COLOURS, large_letters, save
from cspm.plots.run_panels import draw_envelope
from cspm_control.analysis.cable_groups import cable_groups
from cspm_control.analysis.reference_demand import ReferenceDemand
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


def draw_reference(
    path: Path, name: str, testbed: Testbed, limits: Array, demand: ReferenceDemand
) -> None:
    """Write the figure as PNG: a row of tensions per group of cables, motor speeds, torques.

    Instants at which no tensions within the limits give the wrench are shaded.

    Args:
        path: where to.
        name: of the scenario.
        testbed: the machine.
        limits: of tensions, (n, 2) [N].
        demand: of the reference.
    """
    groups = cable_groups(testbed.cable_names)
    torque_limits = np.array([cable.torque_limit for cable in testbed.cables])
    with large_letters():
        figure = Figure(figsize=(12, 2.2 * (len(groups) + 2) + 1.0), layout="constrained")
        FigureCanvasAgg(figure)
        rows = list(figure.subplots(len(groups) + 2, 1, sharex=True))
        for axes, (kind, members) in zip(rows, groups.items(), strict=False):
            _range(axes, demand.times, demand.tensions[:, members])
            _limit(axes, float(limits[members, 0].max()), float(limits[members, 1].min()))
            axes.set_ylabel(f"{kind.replace('_', ' ')}\n[N]")
        _range(rows[-2], demand.times, demand.speeds)
        rows[-2].set_ylabel("motor speed\n[rad/s]")
        shares = 100.0 * demand.torques / torque_limits
        _range(rows[-1], demand.times, shares)
        _limit(rows[-1], -100.0, 100.0)
        rows[-1].set_ylabel("motor torque\n[% of limit]")
        for axes in rows:
            _shade(axes, demand)
        rows[-1].set_xlabel("time [s]")
        share = np.mean(~demand.met)
        verdict = (
            f"no tensions will do {share:.1%} of the time (shaded)"
            if share
            else "within all limits"
        )
        figure.suptitle(f"reference of {name}: {verdict}; limits dashed")
        save(figure, path)


def _range(axes: Axes, times: Array, columns: Array) -> None:
    """Draw between which values the columns (k, m) lie."""
    draw_envelope(axes, times, columns.min(axis=1), columns.max(axis=1), COLOURS[0], "")


def _limit(axes: Axes, *values: float) -> None:
    for value in values:
        axes.axhline(value, color=COLOURS[2], linestyle="--", linewidth=1.0)


def _shade(axes: Axes, demand: ReferenceDemand) -> None:
    """Shade the stretches in which the wrench is infeasible."""
    edges = np.flatnonzero(np.diff((~demand.met).astype(int), prepend=0, append=0))
    pairs: Sequence[tuple[int, int]] = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    for first, end in pairs:
        last = demand.times[min(end, len(demand.times) - 1)]
        axes.axvspan(
            float(demand.times[first]), float(last), color=COLOURS[1], alpha=0.4, linewidth=0
        )
