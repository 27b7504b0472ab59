"""The figure of an identified damping."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_ident.rig.damping import DAMPING, DampingResult

SHOWN = 5.0  # s


def draw_damping(path: Path, result: DampingResult) -> None:
    """Write damping over length with the line, and some seconds of each specimen's tension."""
    count = len(result.specimens)
    figure = Figure(figsize=(11, 2.0 * count + 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(count + 1, 1, height_ratios=[2.0] + [1.0] * count)
    _line(rows[0], result)
    for axes, one in zip(rows[1:], result.specimens, strict=True):
        time = one.signals.time
        shown = time < time[0] + SHOWN
        axes.plot(time[shown], one.signals.tension[shown], label="measured")
        axes.plot(time[shown], one.modelled[shown], "--", label="model, its own b")
        axes.set_ylabel("tension [N]")
        axes.set_title(f"{one.specimen.label}, VAF {one.vaf:.3f} %", fontsize="small", loc="left")
        axes.grid(alpha=0.3)
        axes.margins(x=0)
    rows[1].legend(fontsize="small", ncols=2)
    rows[-1].set_xlabel("time [s]")
    save(figure, path)


def _line(axes: Axes, result: DampingResult) -> None:
    for fitted, style, label in ((True, "o", "fitted"), (False, "s", "not fitted")):
        chosen = [one for one in result.specimens if one.fitted == fitted]
        if not chosen:
            continue
        values = np.array([one.estimate.value(DAMPING) for one in chosen])
        ends = np.array([one.estimate.interval(DAMPING) for one in chosen])
        axes.errorbar(
            [one.mean_length for one in chosen],
            values,
            yerr=np.abs(ends.T - values),
            fmt=style,
            capsize=3,
            label=label,
        )
    if result.law is not None:
        lengths = np.linspace(0.0, 1.1 * max(one.mean_length for one in result.specimens), 2)
        axes.plot(lengths, [result.law.at(x) for x in lengths], color="black", label="line")
    axes.set_xlabel("elastic length [m]")
    axes.set_ylabel("damping [N·s/m]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
