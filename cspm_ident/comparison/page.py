"""The report page of a comparison: measured over simulated over residual, zoomed together."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.compare import Comparison
from cspm_ident.offline_page import (
    BELOW,
    LAYOUT,
    LEGEND,
    figure_html,
    table_html,
    thinned,
    write_offline_page,
)

Array = NDArray[np.float64]

_ROW_PIXELS = 130
_ENTRY_PIXELS = 20
_MODEBAR_PIXELS = 35
_BLOCKS = {
    "whole": "The whole, from measured {drive}",
    "winch": "Winches alone, from measured torques and tensions",
    "cable": "Cables alone, from measured winch and bar motion",
    "bar": "Bar alone, from measured tensions",
}
_QUANTITIES = {
    "time_s": "time [s]",
    "value": "simulated value, in the channel's unit",
    "speed": "speed of the bar or the winch [m/s, rad/s]",
    "angle_rad": "winch angle [rad]",
    "tension_n": "tension [N]",
}
# All lines over time show the same stretch, whichever of them the reader zooms.
_OVER_TIME = "over-time"
_LINKED = f"""<script>
const plots = [...document.querySelectorAll(".{_OVER_TIME} .plotly-graph-div")];
let following = false;
const all = (plot, part, value) => Object.fromEntries(
  Object.keys(plot.layout).filter(name => /^xaxis/.test(name)).map(name => [name + part, value]));
const follow = (zoomed, name) => {{
  const {{autorange, range}} = zoomed.layout[name];
  const change = plot =>
    autorange ? all(plot, ".autorange", true) : all(plot, ".range", [...range]);
  following = true;
  Promise.all(plots.filter(plot => plot !== zoomed).map(p => Plotly.relayout(p, change(p))))
    .finally(() => {{ following = false; }});
}};
plots.forEach(plot => plot.on("plotly_relayout", change => {{
  const moved = Object.keys(change).find(key => /^xaxis/.test(key));
  if (!following && moved) follow(plot, moved.split(".")[0]);
}}));
</script>"""


def write_page(path: Path, comparison: Comparison) -> None:
    """Write one HTML file that needs no network.

    Raises:
        OSError: the file cannot be written.
    """
    title = f"{comparison.measurement.path.name}: measured and simulated"
    parts = [_about(comparison)]
    first = True
    for block in _BLOCKS:
        channels = [channel for channel in comparison.channels if channel.block == block]
        if not channels:
            continue
        heading = _BLOCKS[block].format(drive=comparison.drive.value)
        parts.append(f"<h2>{escape(heading)}</h2>{_table(channels)}")
        lines = figure_html(_lines(channels), script=first)
        parts.append(f"<div class={_OVER_TIME}>{lines}</div>")
        parts.append("<h3>Coherence of measured and simulated</h3>")
        parts.append(figure_html(_spectra(channels), script=False))
        parts.append("<h3>Error against what may drive it</h3>")
        parts.append(figure_html(_bins(channels), script=False))
        first = False
    write_offline_page(path, title, [*parts, _LINKED])


def _about(comparison: Comparison) -> str:
    lines = comparison.clocks
    for source in dict.fromkeys(comparison.noise.values()):
        topics = [topic for topic, each in comparison.noise.items() if each is source]
        lines.append(f"noise from {source.value}: {', '.join(topics)}")
    for topic, band in comparison.bands.items():
        if np.isfinite(band):
            lines.append(f"{topic}: smoothed to {band:.3g} Hz as an input")
    count, failed = comparison.windows
    horizon = f"{comparison.horizon:g} s each" if comparison.horizon else "as long as nothing lacks"
    lines.append(f"{count} window{'s' * (count != 1)}, {horizon}; {failed} diverged")
    lines += [f"{block}: left out, {reason}" for block, reason in comparison.left_out.items()]
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def _table(channels: list[ChannelFit]) -> str:
    heads = ("channel", "VAF %", "NRMSE", "RMS error", "noise floor", "bias", "lag ms", "unit")
    rows = []
    for c in channels:
        cells = (
            c.name,
            "at rest" if c.vaf is None else f"{c.vaf:.3f}",
            "" if c.nrmse is None else f"{c.nrmse:.4f}",
            f"{c.rms:.3g}",
            f"{c.floor:.3g}",
            f"{c.bias:.2g}",
            "" if c.lag is None else f"{round(1e3 * c.lag, 2) + 0.0:.2f}",
            c.unit,
        )
        rows.append(cells)
    return table_html(heads, rows, "accuracy by channel")


def _lines(channels: list[ChannelFit]) -> go.Figure:
    """Return two rows per channel, both signals and their difference, on one time axis."""
    figure = make_subplots(
        rows=2 * len(channels), cols=1, shared_xaxes=True, vertical_spacing=0.08 / len(channels)
    )
    for i, channel in enumerate(channels):
        for values, name, colour, row in (
            (channel.measured, "measured", "#1f77b4", 2 * i + 1),
            (channel.simulated, "simulated", "#ff7f0e", 2 * i + 1),
            (channel.error, "measured − simulated", "#555555", 2 * i + 2),
        ):
            times, shown = thinned(channel.times, values)
            figure.add_scatter(
                x=times,
                y=shown,
                name=name,
                legendgroup=name,
                showlegend=i == 0,
                line={"color": colour, "width": 1},
                row=row,
                col=1,
            )
        label = f"{channel.name.split('/', 1)[-1]}<br>[{channel.unit}]"
        figure.update_yaxes(title_text=label, title_font_size=10, row=2 * i + 1, col=1)
        label = f"error<br>[{channel.unit}]"
        figure.update_yaxes(title_text=label, title_font_size=10, row=2 * i + 2, col=1)
    figure.update_xaxes(title_text="time [s]", row=2 * len(channels), col=1)
    height = 2 * len(channels) * _ROW_PIXELS + 150
    legend = {**LEGEND, "y": 1.0 - _MODEBAR_PIXELS / height, "yanchor": "top"}
    figure.update_layout(height=height, hovermode="x", legend=legend, **LAYOUT)
    return figure


def _spectra(channels: list[ChannelFit]) -> go.Figure:
    figure = go.Figure()
    for i, channel in enumerate(channels):
        frequencies, values = channel.coherence
        if channel.moves and len(frequencies):
            line = {"color": _colour(i, len(channels)), "width": 1}
            figure.add_scatter(x=frequencies, y=values, name=channel.name, mode="lines", line=line)
    figure.update_xaxes(type="log", title_text="frequency [Hz]")
    figure.update_yaxes(title_text="coherence, measured with simulated", range=[0, 1.02])
    figure.update_layout(height=400 + _ENTRY_PIXELS * len(channels), **BELOW)
    return figure


def _bins(channels: list[ChannelFit]) -> go.Figure:
    """Return bias and RMS of the error against each quantity, in multiples of the floor."""
    names = list(dict.fromkeys(name for channel in channels for name in channel.bins))
    rows, titles = max(1, len(names)), [_QUANTITIES[name] for name in names]
    figure = make_subplots(rows=rows, cols=1, subplot_titles=titles, vertical_spacing=0.2 / rows)
    for i, channel in enumerate(channels):
        colour = _colour(i, len(channels))
        for name, bins in channel.bins.items():
            scale = channel.floor or 1.0
            figure.add_scatter(
                x=[each.centre for each in bins],
                y=[each.bias / scale for each in bins],
                error_y={"type": "data", "array": [each.rms / scale for each in bins]},
                name=channel.name,
                legendgroup=channel.name,
                showlegend=name == names[0],
                line={"color": colour},
                row=names.index(name) + 1,
                col=1,
            )
    figure.update_yaxes(title_text="mean error / noise floor, bars: RMS", title_font_size=10)
    figure.update_layout(height=400 * len(names) + _ENTRY_PIXELS * len(channels), **BELOW)
    return figure


def _colour(i: int, count: int) -> str:
    return f"hsl({360 * i // count}, 60%, 45%)"
