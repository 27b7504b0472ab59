"""The figure of measured and predicted poses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm.plots.picture_style import save
from cspm_ident.system.prediction_test import Judgement
from cspm_msgs_py.dofs import DOFS

_MM, _MRAD = 1e3, 1e3
_TRANSLATIONS = 3
_TITLE_PAD = 22  # points, above a legend


def draw_system(path: Path, judgements: Sequence[Judgement]) -> None:
    """Write measured and predicted pose, a row per degree of freedom, a column per recording."""
    figure = Figure(figsize=(6.5 * len(judgements), 11), layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(len(DOFS), len(judgements), squeeze=False, sharex="col")
    for column, each in enumerate(judgements):
        title = each.measurement.path.name + (", held out" if each.held_out else "")
        rows[0][column].set_title(title, pad=_TITLE_PAD)
        for i, dof in enumerate(DOFS):
            axes = rows[i][column]
            straight = i < _TRANSLATIONS
            factor = _MM if straight else _MRAD
            middle = each.measured[:, i].mean()
            shown = factor * (each.measured[:, i] - middle)
            axes.plot(each.times, shown, color="black", label="measured")
            for label, bars in each.simulated.items():
                share = each.vaf[label][dof]
                text = label if share is None else f"{label}, {share:.2f} %"
                line = factor * (bars[:, i] - middle)
                axes.plot(each.times, line, "--", linewidth=1.0, label=text)
            axes.set_ylabel(f"{dof} [{'mm' if straight else 'mrad'}]")
            # Above the axes, where no curve is.
            axes.legend(fontsize="x-small", loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
            axes.grid(alpha=0.3)
            axes.margins(x=0)
        rows[-1][column].set_xlabel("time [s]")
    save(figure, path)
