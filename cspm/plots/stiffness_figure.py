"""Figures of an identified stiffness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_ident.rig.flanks import UP
from cspm_ident.rig.stiffness import SpecimenStiffness, StiffnessResult


def draw_stiffness(path: Path, result: StiffnessResult) -> None:
    """Write k against t of each specimen, both branches and the law, and the law's residuals."""
    figure = Figure(figsize=(11, 9), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    law = result.both.law
    for i, one in enumerate(result.specimens):
        colour = f"C{i}"
        for branch in one.branches:
            dashed = "-" if branch.branch == UP else "--"
            order = np.argsort(branch.tension)
            tension, length = branch.tension[order], branch.length[order]
            measured = branch.stiffness[order]
            label = f"{one.specimen.label} {branch.branch}" + ", not fitted" * (not one.fitted)
            above.plot(tension, measured, dashed, color=colour, label=label)
            modelled = law.stiffness(tension, length)
            above.plot(tension, modelled, color="black", linewidth=0.7)
            below.plot(tension, measured - modelled, dashed, color=colour)
    above.plot([], [], color="black", linewidth=0.7, label="law")
    above.set_ylabel("stiffness [N/m]")
    above.legend(fontsize="small", ncols=2)
    below.set_ylabel("measured − law [N/m]")
    below.set_xlabel("tension [N]")
    _finish(figure, path, (above, below))


def draw_hysteresis(path: Path, result: StiffnessResult) -> None:
    """Write the gap between the branches of each specimen, cycle by cycle, over the tension."""
    count = len(result.specimens)
    figure = Figure(figsize=(11, 2.2 * count + 1.0), layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(count, 1, squeeze=False)[:, 0]
    for axes, one in zip(rows, result.specimens, strict=True):
        _loops(axes, one)
    rows[-1].set_xlabel("tension [N]")
    _finish(figure, path, tuple(rows))


def _loops(axes: Axes, one: SpecimenStiffness) -> None:
    """Draw each cycle's tension less the mean of both branches at equal wound cable."""
    flanks = one.ramps.flanks
    low = max(float(flank.wound.min()) for flank in flanks)
    high = min(float(flank.wound.max()) for flank in flanks)
    grid = np.linspace(low, high, len(flanks[0].wound))
    curves = []
    for flank in flanks:
        order = np.argsort(flank.wound)
        curves.append(np.interp(grid, flank.wound[order], flank.tension[order]))
    middle = np.mean(curves, axis=0)
    for flank, curve in zip(flanks, curves, strict=True):
        colour = "C0" if flank.branch == UP else "C1"
        label = flank.branch if flank.cycle == 0 else None
        axes.plot(middle, curve - middle, color=colour, linewidth=0.8, label=label)
    for side in (-1.0, 1.0):
        label = "damper alone" if side > 0 else None
        axes.axhline(
            side * one.hysteresis.viscous, color="black", linewidth=0.8, linestyle=":", label=label
        )
    axes.set_title(one.specimen.label, fontsize="small", loc="left")
    axes.set_ylabel("t − mean [N]")
    axes.legend(fontsize="small", ncols=3, loc="center left")


def _finish(figure: Figure, path: Path, rows: tuple[Axes, ...]) -> None:
    for axes in rows:
        axes.grid(alpha=0.3)
        axes.margins(x=0)
    save(figure, path)
