"""The figure of a winch's measured and predicted torque."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_ident.winch.identified_winch import DESCRIBED, FITTED, IdentifiedWinch, WinchJudgement

# Most samples that a figure shows.
_MOST = 4000
_COLOURS = {DESCRIBED: "C1", FITTED: "C0"}


def draw_winch(path: Path, winch: IdentifiedWinch) -> None:
    """Write the figure of measured and predicted torque, with residuals over time and speed.

    It has one column per recording.
    """
    count = len(winch.judgements)
    figure = Figure(figsize=(7.5 * count, 10), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(winch.name)
    rows = figure.subplots(3, count, squeeze=False, height_ratios=(2, 1, 1.4))
    for column, each in enumerate(winch.judgements):
        torque, rest, against = rows[:, column]
        role = ", held out" if each.held_out else ""
        # Above the legend.
        torque.set_title(f"{each.measurement.path.name}{role}", pad=24)
        _over_time(torque, rest, each)
        _over_speed(against, each)
        rest.sharex(torque)
    save(figure, path)


def _over_time(torque: Axes, rest: Axes, each: WinchJudgement) -> None:
    for label, found in each.errors.items():
        skip = max(1, len(found.times) // _MOST)
        times, left = found.times[::skip], (found.measured - found.predicted)[::skip]
        if label == FITTED:
            measured = found.measured[::skip]
            torque.plot(times, measured, color="black", linewidth=1.0, label="measured")
        colour = _COLOURS[label]
        text = f"{label}, error {found.percent:.2f} %"
        torque.plot(times, found.predicted[::skip], "--", color=colour, linewidth=1.0, label=text)
        rest.plot(times, left, color=colour, linewidth=0.7, label=label)
    torque.set_ylabel("torque [N·m]")
    rest.set_ylabel("measured − predicted [N·m]")
    rest.set_xlabel("time [s]")
    for axes in (torque, rest):
        axes.margins(x=0)
    _finish(torque, rest)


def _over_speed(axes: Axes, each: WinchJudgement) -> None:
    for label, found in each.errors.items():
        skip = max(1, len(found.times) // _MOST)
        left = (found.measured - found.predicted)[::skip]
        axes.plot(found.speeds[::skip], left, ".", color=_COLOURS[label], markersize=2, label=label)
    axes.set_xlabel("speed of the motor shaft [rad/s]")
    axes.set_ylabel("measured − predicted [N·m]")
    _finish(axes)


def _finish(*rows: Axes) -> None:
    for axes in rows:
        axes.grid(alpha=0.3)
        # Above the axes, where no curve is.
        axes.legend(fontsize="small", loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
