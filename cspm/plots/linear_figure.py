"""The figure of a linear analysis: singular values and relative gains over frequency."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm_control.analysis.gain import ZERO_SHARE
from cspm_control.analysis.linear import FREQUENCIES, LinearAnalyses, SubsystemAnalysis
from cspm_msgs_py.dofs import DOFS

DPI = 90
LOWEST_DB = -160.0


def draw_linear(path: Path, found: LinearAnalyses, cables: tuple[str, ...]) -> None:
    """Write singular values and own relative gains of both sub-systems of both models."""
    figure = Figure(figsize=(12, 9), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, sharex=True)
    for column, name in enumerate(("motion", "tension")):
        frozen: SubsystemAnalysis = getattr(found.frozen, name)
        exact: SubsystemAnalysis = getattr(found.exact, name)
        _gains(axes[0, column], frozen, exact)
        axes[0, column].set_title(f"{name} sub-system")
        _relative(axes[1, column], frozen, exact, DOFS if name == "motion" else cables)
    figure.savefig(path, dpi=DPI)


def _gains(axes: Axes, frozen: SubsystemAnalysis, exact: SubsystemAnalysis) -> None:
    for part, style, label in (
        (frozen, "-", "cable directions held, as in the thesis"),
        (exact, "--", "exact"),
    ):
        nothing = part.gains < ZERO_SHARE * part.gains[:, :1]
        decibels = 20.0 * np.log10(np.where(nothing, np.nan, part.gains))
        axes.set_prop_cycle(None)
        lines = axes.semilogx(FREQUENCIES, decibels, style)
        lines[0].set_label(label)
    axes.set_ylim(bottom=max(LOWEST_DB, axes.get_ylim()[0]))
    axes.set_ylabel("singular values [dB]")
    axes.legend(fontsize="small", loc="lower left")
    axes.grid(alpha=0.3)


def _relative(
    axes: Axes, frozen: SubsystemAnalysis, exact: SubsystemAnalysis, names: tuple[str, ...]
) -> None:
    for part, style in ((frozen, "-"), (exact, "--")):
        axes.set_prop_cycle(None)
        for i, name in enumerate(names):
            own = part.relative[:, i, i].real
            axes.semilogx(FREQUENCIES, own, style, label=name if style == "-" else None)
    lowest, highest = axes.get_ylim()
    axes.set_ylim(max(lowest, -1.0), min(highest, 3.0))
    axes.set_ylabel("relative gain of each on itself")
    axes.set_xlabel("frequency [rad/s]")
    axes.legend(fontsize="small", ncols=2)
    axes.grid(alpha=0.3)
