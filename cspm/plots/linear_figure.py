"""The figure of a linear analysis: singular values and relative gains over frequency."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import PALETTE, save
from cspm_control.analysis.gain import ZERO_SHARE
from cspm_control.analysis.linear import FREQUENCIES, LinearAnalyses, SubsystemAnalysis
from cspm_msgs_py.dofs import DOFS

LOWEST_DB = -160.0
# Curves closer than this over all frequencies are drawn as one, which has all their names.
ALIKE = 5e-3
_WIDTHS = {"-": 2.0, "--": 1.0}


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
    save(figure, path)


def _gains(axes: Axes, frozen: SubsystemAnalysis, exact: SubsystemAnalysis) -> None:
    for part, style, label in (
        (frozen, "-", "cable directions held, as in the thesis"),
        (exact, "--", "exact"),
    ):
        nothing = part.gains < ZERO_SHARE * part.gains[:, :1]
        decibels = 20.0 * np.log10(np.where(nothing, np.nan, part.gains))
        axes.set_prop_cycle(color=PALETTE)
        lines = axes.semilogx(FREQUENCIES, decibels, style, linewidth=_WIDTHS[style])
        lines[0].set_label(label)
    axes.set_ylim(bottom=max(LOWEST_DB, axes.get_ylim()[0]))
    axes.set_ylabel("singular values [dB]")
    axes.legend(fontsize="small", loc="lower left")
    axes.grid(alpha=0.3)


def _relative(
    axes: Axes, frozen: SubsystemAnalysis, exact: SubsystemAnalysis, names: tuple[str, ...]
) -> None:
    groups = _alike(frozen, exact, names)
    for part, style in ((exact, "--"), (frozen, "-")):
        for colour, members in zip(cycle(PALETTE), groups, strict=False):
            own = part.relative[:, members[0], members[0]].real
            label = ", ".join(names[i] for i in members) if style == "-" else None
            width = _WIDTHS[style]
            axes.semilogx(FREQUENCIES, own, style, color=colour, linewidth=width, label=label)
    lowest, highest = axes.get_ylim()
    axes.set_ylim(max(lowest, -1.0), min(highest, 3.0))
    axes.set_ylabel("relative gain of each on itself")
    axes.set_xlabel("frequency [rad/s]")
    # Above the axes, where no curve is.
    axes.legend(fontsize="small", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    axes.grid(alpha=0.3)


def _alike(
    frozen: SubsystemAnalysis, exact: SubsystemAnalysis, names: tuple[str, ...]
) -> list[list[int]]:
    """Return the indices of curves that lie on each other in both models, a list per curve."""
    groups: list[list[int]] = []
    for i in range(len(names)):
        for members in groups:
            k = members[0]
            pairs = ((part.relative[:, i, i], part.relative[:, k, k]) for part in (frozen, exact))
            if all(np.allclose(one, other, atol=ALIKE, rtol=ALIKE) for one, other in pairs):
                members.append(i)
                break
        else:
            groups.append([i])
    return groups
