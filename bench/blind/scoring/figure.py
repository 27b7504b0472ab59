"""The scorecard in pictures: targets, amounts, probabilities, and peers or ways of concealing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bench.blind.scoring.target import allowed, findings_judged, numbers_judged

Data = Mapping[str, Any]

_DPI, _SIZE = 110, (12.0, 9.0)
_MET, _MISSED = "tab:green", "tab:red"
_AMOUNTS = {"detected": "anything found", "tied": "truth among the ties", "named": "all named"}
# By key of a row, label and colour.
_METHODS = {
    "first": ("named first", "C0"),
    "nothing_wrong_beside": ("named, nothing wrong beside", "C1"),
    "false_alarm": ("false alarm", _MISSED),
}
_STRATA = {"detected": ("anything found", "C0"), "named": ("all named", "C1")}


def draw_scorecard(path: Path, card: Data) -> None:
    """Draw a scorecard.

    Args:
        path: of the PNG file.
        card: the scorecard, with the rows of `peers` beside it (`comparison`).
    """
    figure = Figure(figsize=_SIZE, layout="constrained")
    ((targets, amounts), (methods, calibration)) = figure.subplots(2, 2)
    _draw_targets(targets, card)
    _draw_amounts(amounts, card["by_multiple"])
    if card["peers"]:
        _draw_bars(methods, card["peers"], "method", _METHODS)
        methods.set_title(f"Peers on the same {card['peers'][0]['scored']} recordings")
    else:
        _draw_bars(methods, _by_stratum(card), "stratum", _STRATA)
        methods.set_title("By way of concealing")
    _draw_calibration(calibration, card["calibration"])
    FigureCanvasAgg(figure).print_figure(path, dpi=_DPI)


def _draw_targets(axes: Axes, card: Data) -> None:
    """Draw shares with their intervals over what they are to reach, best first named."""
    rows = [r for r in (*findings_judged(card), *numbers_judged(card)) if r.target and r.found[1]]
    for height, row in enumerate(rows):
        least, most = allowed(row.target)
        axes.barh(height, max(most - least, 0.005), left=least, color=_MET, alpha=0.25)
        value = row.found[0] / row.found[1]
        colour = _MET if least <= value <= most else _MISSED
        _draw_share(axes, height, row.found, colour, upright=False)
    axes.set_yticks(range(len(rows)), [row.label for row in rows])
    axes.invert_yaxis()
    axes.set(xlim=(-0.02, 1.02), xlabel="share of cases, 95 % interval")
    axes.set_title("Against the targets (shaded)")


def _draw_amounts(axes: Axes, rows: Sequence[Data]) -> None:
    for k, (key, label) in enumerate(_AMOUNTS.items()):
        known = [row for row in rows if row[key][1]]
        # Beside each other, so that no interval covers another.
        at = [row["multiple"] * 1.04 ** (k - 1) for row in known]
        axes.plot(at, [row[key][0] / row[key][1] for row in known], color=f"C{k}", label=label)
        for x, row in zip(at, known, strict=True):
            _draw_share(axes, x, row[key], f"C{k}", upright=True)
    axes.set_xscale("log", base=2)
    axes.set_xticks([row["multiple"] for row in rows], [f"{row['multiple']:g}" for row in rows])
    axes.set(ylim=(-0.02, 1.02), xlabel="amount in detection limits", ylabel="share of cases")
    axes.set_title("By amount")
    axes.legend(loc="lower right")


def _draw_bars(
    axes: Axes, rows: Sequence[Data], name: str, kinds: Mapping[str, tuple[str, str]]
) -> None:
    width = 0.8 / len(kinds)
    for k, (key, (label, colour)) in enumerate(kinds.items()):
        for height, row in enumerate(rows):
            hits, cases = row[key][:2]
            at = height + (k - 0.5 * (len(kinds) - 1)) * width
            share = hits / cases if cases else 0.0
            axes.barh(at, share, width, color=colour, label=None if height else label)
            axes.annotate(f" {hits:g} of {cases:g}", (share, at), va="center", fontsize=8)
    axes.set_yticks(range(len(rows)), [row[name] for row in rows])
    axes.invert_yaxis()
    axes.set(xlim=(0.0, 1.18), xlabel="share of cases")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=len(kinds), fontsize=9)


def _by_stratum(card: Data) -> list[dict[str, Any]]:
    keys = ("detected", "named")
    return [
        {"stratum": row["stratum"], **{key: (row[key], row["cases"]) for key in keys}}
        for row in card["by_stratum"]
    ]


def _draw_calibration(axes: Axes, rows: Sequence[Data]) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color="black", linewidth=0.8, label="as reported")
    for row in rows:
        if row["right"][1]:
            _draw_share(axes, row["said"], row["right"], "C0", upright=True)
            _, cases, _, high = row["right"]
            place = row["said"] - 0.01, high
            axes.annotate(f"{cases:g} findings", place, ha="right", fontsize=8)
    axes.set(xlim=(0.0, 1.02), ylim=(-0.02, 1.02))
    axes.set(xlabel="reported probability, mean", ylabel="share that was right")
    axes.set_title("Probabilities")
    axes.legend(loc="upper left")


def _draw_share(
    axes: Axes, at: float, found: Sequence[float], colour: str, *, upright: bool
) -> None:
    """Draw a share of cases as a dot, with its interval as a line."""
    hits, cases, low, high = found
    value = hits / cases
    ends = np.array([[max(0.0, value - low)], [max(0.0, high - value)]])
    if upright:
        axes.errorbar(at, value, yerr=ends, fmt="o", color=colour, capsize=3)
    else:
        axes.errorbar(value, at, xerr=ends, fmt="o", color=colour, capsize=3)
