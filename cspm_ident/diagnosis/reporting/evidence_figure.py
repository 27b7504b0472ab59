"""The evidence for a finding, drawn: its residual against its driver, and over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from cspm_ident.diagnosis.reporting.machine_part import part_behind
from cspm_ident.diagnosis.validation.residual_curves import Curve, bins_of
from cspm_ident.offline_page import AFTER, BEFORE, BELOW, MEASURED, thinned
from cspm_sim.effects import Channel

Array = NDArray[np.float64]

# Most points of a drawn curve.
_POINTS = 1500
# Bins of a fitted law along its signal: a step is as wide on the page as one of these.
_LAW_BINS = 300
# Share of a law's squares that a signal explains, from which it is drawn as a line over it.
_OWN = 0.9
# Ratio to the usual step from which a step counts as a gap.
_HOLE = 3.0
_DOTS = {"mode": "markers", "opacity": 0.35}
# Significant digits of drawn values, more than a screen resolves.
_DIGITS = 5


def caption_of(curve: Curve, signal: str) -> str:
    """Return a residual's size and its dependence on a signal, before and after the findings.

    Args:
        curve: the residual; its rows are those that are searched.
        signal: one of its signals, or empty.
    """
    of = f", {curve.component}" if curve.component else ""
    before, after = (float(np.sqrt(np.mean(v**2))) for v in (curve.before, curve.after))
    then = f" before and {after:.3g} {curve.unit} after" if curve.touched else ""
    away = ", apart from where the shaft reverses" if curve.place.channel is Channel.SHAFT else ""
    text = (
        f"{part_behind(curve.place).words}{of}: the residual is measured less modelled; its root"
        f" mean square is {before:.3g} {curve.unit}{then}{away}."
    )
    return f"{text} {_dependence(curve, signal)}" if signal else text


def _dependence(curve: Curve, signal: str) -> str:
    """Return how much of the squares that were there is a function of a signal, and is left."""
    whole = max(float(np.sum(curve.before**2)), 1e-300)
    edges, home = bins_of(curve.signals[signal])
    before, after = (
        100.0 * float(np.sum(_means(v, home, len(edges) - 1)[home] ** 2)) / whole
        for v in (curve.before, curve.after)
    )
    then = f" before, {after:.2g} % after" if curve.touched else ""
    name = signal.split(" [")[0]
    return f"{name[:1].upper()}{name[1:]} explains {before:.2g} % of the squared residual{then}."


def driver_figure(curve: Curve, name: str) -> go.Figure:
    """Return the residual before and after against one of its signals.

    Dots are samples, and large marks means over bins with equally many samples. The line is the
    law that was fitted, with its steps. It and what is left after it are omitted where no finding
    acts on the residual.
    """
    figure = go.Figure()
    signal = curve.signals[name]
    step = max(1, len(signal) // _POINTS)
    edges, home = bins_of(signal)
    centres = _means(signal, home, len(edges) - 1)
    stages = [(curve.before, "before", BEFORE, "circle")]
    if curve.touched:
        stages.append((curve.after, "after", AFTER, "diamond"))
    for values, stage, colour, symbol in stages:
        marker = {"color": colour, "size": 4, "symbol": symbol}
        shown = _short(signal[::step]), _short(values[::step])
        figure.add_scatter(x=shown[0], y=shown[1], name=stage, marker=marker, **_DOTS)
    for values, stage, colour, symbol in stages:
        figure.add_scatter(
            x=_short(centres),
            y=_short(_means(values, home, len(edges) - 1)),
            name=f"{stage}, mean",
            mode="markers",
            marker={
                "color": colour,
                "size": 9,
                "symbol": symbol,
                "line": {"color": "white", "width": 1},
            },
        )
    if curve.touched:
        figure.add_scatter(**_law(signal, curve.before - curve.after))
    figure.update_xaxes(title_text=name)
    figure.update_yaxes(title_text=f"residual [{curve.unit}]")
    figure.update_layout(height=430, **BELOW)
    return figure


def _law(signal: Array, law: Array) -> dict[str, Any]:
    """Return what the findings add to a residual, over one of its signals.

    A line where the signal explains it, with an edge at zero, where laws of friction have their
    step; otherwise points, since it depends on other signals too.
    """
    count = min(_LAW_BINS, max(1, len(signal) // 4))
    edges = np.unique(np.append(np.quantile(signal, np.linspace(0.0, 1.0, count + 1)), 0.0))
    edges = edges[(edges >= signal.min()) & (edges <= signal.max())]
    home = np.clip(np.searchsorted(edges, signal, side="right") - 1, 0, max(len(edges) - 2, 0))
    means = _means(law, home, max(len(edges) - 1, 1))
    away = float(np.sum((law - means[home]) ** 2))
    if away > (1.0 - _OWN) * max(float(np.sum(law**2)), 1e-300):
        step = max(1, len(signal) // _POINTS)
        marker = {"color": BEFORE, "size": 3, "symbol": "x"}
        points = {"x": _short(signal[::step]), "y": _short(law[::step])}
        return {"name": "fitted law", "mode": "markers", "marker": marker, **points}
    known = np.bincount(home, minlength=len(means)) > 0
    x, y = _means(signal, home, len(means))[known], means[known]
    line = {"color": BEFORE, "width": 3}
    return {"name": "fitted law", "mode": "lines", "line": line, "x": _short(x), "y": _short(y)}


def overlay_figure(curve: Curve) -> go.Figure:
    """Return the measured and modelled quantity, and the residuals, over time."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    model, improved = curve.measured - curve.before, curve.measured - curve.after
    lines = [
        (curve.measured, "measured", MEASURED, 1),
        (model, "before", BEFORE, 1),
        (curve.before, "before", BEFORE, 2),
    ]
    if curve.touched:
        lines += [(improved, "after", AFTER, 1), (curve.after, "after", AFTER, 2)]
    for values, name, colour, row in lines:
        times, shown = _line(curve.times, values)
        # The measured curve lies below and is wider, so that it is visible where the model agrees.
        width = 4.0 if name == "measured" else 1.2
        figure.add_scatter(
            x=times,
            y=shown,
            name=name,
            mode="lines",
            legendgroup=name,
            showlegend=row == 1,
            line={"color": colour, "width": width},
            row=row,
            col=1,
        )
    figure.update_xaxes(title_text="time [s]", row=2, col=1)
    figure.update_yaxes(title_text=f"[{curve.unit}]", row=1, col=1)
    figure.update_yaxes(title_text=f"residual [{curve.unit}]", row=2, col=1)
    figure.update_layout(height=560, hovermode="x", **BELOW)
    return figure


def _means(values: Array, home: NDArray[np.intp], bins: int) -> Array:
    counts = np.bincount(home, minlength=bins)
    return np.asarray(np.bincount(home, weights=values, minlength=bins) / np.maximum(counts, 1))


def _line(times: Array, values: Array) -> tuple[list[float | None], list[float | None]]:
    """Return the thinned line, interrupted where rows are missing."""
    holes = np.flatnonzero(np.diff(times) > _HOLE * np.median(np.diff(times)))
    shown_times, shown = thinned(times, values, _POINTS)
    x: list[float | None] = list(_short(shown_times))
    y: list[float | None] = list(_short(shown))
    for after in sorted(set(np.searchsorted(shown_times, times[holes], side="right")))[::-1]:
        x.insert(int(after), None)
        y.insert(int(after), None)
    return x, y


def _short(values: Array) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]
