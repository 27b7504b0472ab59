"""The figure of a diagnosis: every hold-out residual, before and after the findings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.statement import channel_of
from cspm_ident.diagnosis.reporting.verdict import verdict_of

_STAGES = (
    ("before", "o", "tab:red"),
    ("retuned", "s", "tab:orange"),
    ("after", "D", "tab:green"),
)
_LABELS = {
    "before": "as described",
    "retuned": "its numbers re-tuned",
    "after": "with what was found",
}


def draw_diagnosis(path: Path, found: Diagnosis) -> None:
    """Write each residual's root mean square over its noise, one line per residual."""
    figure = Figure(figsize=(9, 1.6 + 0.32 * len(found.fit)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    height = np.arange(len(found.fit))
    # Ideal sensors have no noise that a residual could be a multiple of: those are not drawn.
    noise = np.array([fit.noise or np.nan for fit in found.fit])
    for name, marker, colour in _STAGES:
        values = np.array([getattr(fit, name) for fit in found.fit]) / noise
        axes.plot(values, height, marker, color=colour, label=_LABELS[name], alpha=0.8)
    for row, fit, unit in zip(height, found.fit, noise, strict=True):
        ends = fit.before / unit, fit.after / unit
        axes.plot(ends, (row, row), color="0.6", linewidth=1.0, zorder=0)
    axes.axvline(1.0, color="black", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_yticks(height, [channel_of(fit) for fit in found.fit])
    axes.invert_yaxis()
    axes.set_xlabel("held-out residual, RMS over what differs from row to row (black line)")
    names = [f"{each.effect} on {', '.join(each.elements)}" for each in found.reported]
    axes.set_title("\n".join([f"verdict: {verdict_of(found).value}", *names]), fontsize="medium")
    axes.grid(axis="x", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, fontsize="small")
    save(figure, path)
