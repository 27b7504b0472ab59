"""Figures of control loops: Bode plots and step responses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_control.analysis.loop_view import LOWEST_FREQUENCY, LoopView
from cspm_control.analysis.loops import CASCADE, DESIGNED, LATE, SAMPLED, LoopAnalysis

LOWEST_DB = -80.0
HIGHEST_FREQUENCY = 5e3  # rad/s
HIGHEST_PHASE = 30.0  # °
STYLES = {DESIGNED: "-", SAMPLED: "--", CASCADE: "--", LATE: ":"}


def draw_motion_loops(path: Path, found: LoopAnalysis) -> None:
    """Write each DOF's plant, open and closed loop, designed and in the cascade, and its steps."""
    ways: dict[str, tuple[str, str | None]] = {
        "designed": (DESIGNED, SAMPLED),
        "in the cascade": (CASCADE, CASCADE),
    }
    _draw(path, found.motion, list(found.motion[DESIGNED]), ways)


def draw_force_loops(path: Path, found: LoopAnalysis, cables: Sequence[str]) -> None:
    """Write the same of some cables, designed, sampled, and with time for computing."""
    ways: dict[str, tuple[str, str | None]] = {
        "designed": (DESIGNED, None),
        "sampled": (SAMPLED, SAMPLED),
        "and computing": (LATE, LATE),
    }
    _draw(path, found.force, cables, ways)


def _draw(
    path: Path,
    views: dict[str, dict[str, LoopView]],
    names: Sequence[str],
    ways: dict[str, tuple[str, str | None]],
) -> None:
    """Draw a column per loop; each way names the source of its Bode plot and step response."""
    figure = Figure(figsize=(3.4 * len(names) + 1.0, 8.5), layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(3, len(names), squeeze=False, sharey="row")
    for column, name in zip(rows.T, names, strict=True):
        column[0].set_title(name)
        for label, (way, stepped) in ways.items():
            _bode(column[0], column[1], views[way][name], STYLES[way], label)
            if stepped is not None:
                step = views[stepped][name]
                column[2].plot(step.time, step.step, STYLES[way], color="tab:green")
        column[1].set_xlabel("frequency [rad/s]")
        column[2].set_xlabel("time [s]")
        for axes in column:
            axes.grid(alpha=0.3)
    for axes, label in zip(
        rows[:, 0], ("gain [dB]", "phase [°]", "sampled step of what is wanted"), strict=True
    ):
        axes.set_ylabel(label)
    rows[0, 0].set_ylim(bottom=LOWEST_DB)
    handles, labels = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(ways))
    save(figure, path)


def _bode(gain: Axes, phase: Axes, view: LoopView, style: str, label: str) -> None:
    lines = (
        ("plant", view.plant, "tab:blue"),
        ("open loop", view.open_loop, "tab:red"),
        ("closed loop", view.open_loop / (1.0 + view.open_loop), "tab:green"),
    )
    for name, values, colour in lines:
        decibels = 20.0 * np.log10(np.abs(values))
        gain.semilogx(view.frequencies, decibels, style, color=colour, label=f"{name}, {label}")
        degrees = np.degrees(np.unwrap(np.angle(values)))
        # The phase is unwrapped from its first value, between −330° and 30°.
        degrees -= 360.0 * np.ceil((degrees[0] - HIGHEST_PHASE) / 360.0)
        phase.semilogx(view.frequencies, degrees, style, color=colour)
    phase.set_xlim(LOWEST_FREQUENCY, HIGHEST_FREQUENCY)
    gain.set_xlim(LOWEST_FREQUENCY, HIGHEST_FREQUENCY)
    phase.set_yticks([-360, -270, -180, -90, 0])
    phase.set_ylim(-375.0, HIGHEST_PHASE)
