"""The report page of a comparison: verdict and table first, then the worst channels."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from cspm_ident.channel_words import channel_words
from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.compare import Comparison
from cspm_ident.offline_page import (
    AFTER,
    BEFORE,
    BELOW,
    MEASURED,
    figure_html,
    table_html,
    thinned,
    write_offline_page,
)

Array = NDArray[np.float64]

_CHANNEL_PIXELS = 420
_ENTRY_PIXELS = 20
# Points per line of channels that are drawn at once, and of those that are folded.
_LINE_POINTS, _FOLDED_POINTS = 2000, 800
# Channels that are drawn at once; the others are folded.
_OPEN = 5
# Below it a VAF says no more than that nothing is explained [%].
_LEAST_VAF = -100.0
# An error beyond this multiple of its noise floor is named in the verdict. Of a floor that is
# known to a tenth, 1.5 lies five standard errors above it.
_BEYOND = 1.5
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
const plots = () => [...document.querySelectorAll(".{_OVER_TIME} .plotly-graph-div")];
let following = false;
const all = (plot, part, value) => Object.fromEntries(
  Object.keys(plot.layout).filter(name => /^xaxis/.test(name)).map(name => [name + part, value]));
const follow = (zoomed, name) => {{
  const {{autorange, range}} = zoomed.layout[name];
  const change = plot =>
    autorange ? all(plot, ".autorange", true) : all(plot, ".range", [...range]);
  following = true;
  const others = plots().filter(plot => plot !== zoomed && plot.layout);
  Promise.all(others.map(plot => Plotly.relayout(plot, change(plot))))
    .finally(() => {{ following = false; }});
}};
document.addEventListener("drawn", ({{target}}) => {{
  if (plots().includes(target)) target.on("plotly_relayout", change => {{
    const moved = Object.keys(change).find(key => /^xaxis/.test(key));
    if (!following && moved) follow(target, moved.split(".")[0]);
  }});
}});
</script>"""


def write_page(path: Path, comparison: Comparison) -> None:
    """Write one HTML file that needs no network.

    Raises:
        OSError: the file cannot be written.
    """
    ranked = sorted(comparison.channels, key=_excess, reverse=True)
    parts = [_verdict(ranked), _worst(ranked[:_OPEN])]
    parts += [_channel(each, comparison, _LINE_POINTS) for each in ranked[:_OPEN]]
    if ranked[_OPEN:]:
        folded = "".join(_channel(each, comparison, _FOLDED_POINTS) for each in ranked[_OPEN:])
        title_of_rest = f"The other {len(ranked) - _OPEN} channels, which differ less"
        parts.append(_folded(title_of_rest, folded))
    parts.append(_folded("All numbers of all channels", _table(ranked, comparison)))
    parts += [_block(block, comparison) for block in _BLOCKS]
    parts.append(_folded("How it was compared", _about(comparison)))
    write_offline_page(path, _title(ranked, comparison), [*parts, _LINKED])


def _title(ranked: list[ChannelFit], comparison: Comparison) -> str:
    """Return the recording and what is worst, in a line."""
    name = comparison.measurement.path.name
    if not ranked:
        return f"{name}: nothing could be compared"
    if _excess(ranked[0]) <= _BEYOND:
        return f"{name}: all {len(ranked)} channels agree with the simulation to their noise"
    worst = channel_words(ranked[0].name)
    return f"{name}: {worst} is {_times(ranked[0])} × its noise from the simulation"


def _folded(title: str, body: str) -> str:
    return f"<details><summary>{escape(title)}</summary>{body}</details>"


def _worst(ranked: list[ChannelFit]) -> str:
    """Return the worst channels in few columns, linked to their lines."""
    heads = ("worst channels", "from", "error / floor", "RMS error", "noise floor", "unit")
    rows = [
        (channel_words(c.name), c.block, _times(c), f"{c.rms:.3g}", f"{c.floor:.3g}", c.unit)
        for c in ranked
    ]
    return table_html(heads, rows, "the worst channels", [f"#{_id(each)}" for each in ranked])


def _excess(channel: ChannelFit) -> float:
    """Return the RMS error in multiples of its noise floor."""
    return channel.rms / channel.floor if channel.floor > 0.0 else float(channel.rms > 0.0)


def _times(channel: ChannelFit) -> str:
    """Return the excess as text, in two digits, or whole where it has more."""
    excess = _excess(channel)
    return f"{excess:.0f}" if excess >= 10.0 else f"{excess:.2g}"


def _verdict(ranked: list[ChannelFit]) -> str:
    """Return in a sentence or two how many channels agree, and which is the worst."""
    if not ranked:
        return "<p class=verdict>Nothing could be compared.</p>"
    beyond = [each for each in ranked if _excess(each) > _BEYOND]
    text = f"{len(ranked) - len(beyond)} of {len(ranked)} channels agree within their noise."
    if beyond:
        worst = beyond[0]
        text += (
            f" The worst is {_words(worst)}: its error is {_times(worst)} times the noise floor."
        )
    return f"<p class=verdict>{escape(text)}</p>"


def _words(channel: ChannelFit) -> str:
    return f"{channel_words(channel.name)} ({channel.block})"


def _id(channel: ChannelFit) -> str:
    return f"{channel.block}-{channel.name}".replace("/", "-")


def _channel(channel: ChannelFit, comparison: Comparison, points: int) -> str:
    """Return one channel with its lines over time."""
    from_what = _BLOCKS[channel.block].format(drive=comparison.drive.value)
    figure = figure_html(_lines(channel, points))
    return (
        f"<section id={_id(channel)}><h2>{escape(channel_words(channel.name))}</h2>"
        f"<p>{escape(from_what)}. Error {channel.rms:.3g} {escape(channel.unit)} RMS,"
        f" noise floor {channel.floor:.3g} {escape(channel.unit)}.</p>"
        f"<div class={_OVER_TIME}>{figure}</div></section>"
    )


def _block(block: str, comparison: Comparison) -> str:
    """Return spectra and drivers of the errors of a block, folded; empty without channels."""
    channels = [channel for channel in comparison.channels if channel.block == block]
    if not channels:
        return ""
    heading = _BLOCKS[block].format(drive=comparison.drive.value)
    return (
        f"<details><summary>{escape(heading)}: coherence, and what may drive the error</summary>"
        f"<h3>Coherence of measured and simulated</h3>{figure_html(_spectra(channels))}"
        f"<h3>Error against what may drive it</h3>{figure_html(_bins(channels))}</details>"
    )


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


def _table(channels: list[ChannelFit], comparison: Comparison) -> str:
    """Return a row per channel, linked to its lines, in the given order."""
    heads = (
        *("channel", "from", "error / floor", "RMS error", "noise floor", "unit", "VAF %"),
        *("NRMSE", "bias", "lag ms"),
    )
    rows = []
    for c in channels:
        cells = (
            channel_words(c.name),
            c.block,
            _times(c),
            f"{c.rms:.3g}",
            f"{c.floor:.3g}",
            c.unit,
            _explained(c.vaf),
            "" if c.nrmse is None else f"{c.nrmse:.3g}",
            f"{c.bias:.3g}",
            "" if c.lag is None else f"{1e3 * c.lag + 0.0:.3g}",
        )
        rows.append(cells)
    links = [f"#{_id(each)}" for each in channels]
    note = "".join(
        f"<li>{escape(name)}: {escape(text.format(drive=comparison.drive.value))}</li>"
        for name, text in _BLOCKS.items()
        if any(c.block == name for c in channels)
    )
    return f"{table_html(heads, rows, 'accuracy by channel', links)}<ul>{note}</ul>"


def _explained(vaf: float | None) -> str:
    """Return the variance accounted for [%] in three digits."""
    if vaf is None:
        return "at rest"
    return f"below −{-_LEAST_VAF:.0f}" if vaf < _LEAST_VAF else f"{vaf:.3g}"


def _lines(channel: ChannelFit, points: int) -> go.Figure:
    """Return measured and simulated signal, and below them their difference and its floor."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    # The measured line is wide and below, so that it is seen where both agree.
    for values, name, colour, width, row in (
        (channel.measured, "measured", MEASURED, 4, 1),
        (channel.simulated, "simulated", BEFORE, 1.2, 1),
        (channel.error, "measured − simulated", AFTER, 1, 2),
    ):
        times, shown = thinned(channel.times, values, points)
        line = {"color": colour, "width": width}
        x, y = times.astype(np.float32), shown.astype(np.float32)
        figure.add_scatter(x=x, y=y, name=name, mode="lines", line=line, row=row, col=1)
    for side in (-channel.floor, channel.floor):
        figure.add_hline(y=side, line={"color": "#888", "dash": "dash", "width": 1}, row=2, col=1)
    figure.update_yaxes(title_text=f"[{channel.unit}]", row=1, col=1)
    figure.update_yaxes(title_text=f"error [{channel.unit}]", row=2, col=1)
    figure.update_xaxes(title_text="time [s]", row=2, col=1)
    figure.update_layout(height=_CHANNEL_PIXELS, hovermode="x", **BELOW)
    figure.update_layout(margin_t=30)
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
