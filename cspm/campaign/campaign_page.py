"""The page of a campaign: distributions, what moves them, worst and failed runs."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from cspm.campaign.campaign import Campaign
from cspm.campaign.campaign_folder import PAGE
from cspm.campaign.summary import SPREAD, axes_of, reading_of, spread_cells
from cspm.plots.picture_style import COLOURS
from cspm_ident.offline_page import LAYOUT, figure_html, scrolled, table_html, write_offline_page

_ACROSS, _HEIGHT = 3, 260
_MOST_LISTED = 30


def write_campaign_page(campaign: Campaign, found: dict[str, Any]) -> Path:
    """Write `campaign.html` into a campaign's folder, and return its path.

    Args:
        campaign: what was run.
        found: what `summary_of` says of it.

    Raises:
        OSError: the file cannot be written.
    """
    parts = [f"<p class=verdict>{escape(headline(campaign, found))}</p>"]
    if found["metrics"]:
        drawn = figure_html(_distributions(campaign, found))
        parts += [_spread_table(found), scrolled(drawn, "distributions of the metrics")]
    if found["sensitivities"]:
        parts += _sensitivity_parts(campaign, found)
    if found["verdicts"]:
        rows = [(name, str(count)) for name, count in found["verdicts"].items()]
        parts += ["<h2>Verdicts</h2>", table_html(("verdict", "runs"), rows, "verdicts")]
    parts += _worst_parts(found) + _failure_parts(campaign)
    path = campaign.folder / PAGE
    write_offline_page(path, f"Campaign {campaign.file.name}", parts)
    return path


def headline(campaign: Campaign, found: dict[str, Any]) -> str:
    """Return how many runs ended, and how."""
    counted = ", ".join(f"{count} {name}" for name, count in found["status"].items())
    axes = ", ".join(axes_of(campaign)) or "nothing"
    return f"{found['ended']} of {found['runs']} runs: {counted or 'none'}. Varied: {axes}."


def _spread_table(found: dict[str, Any]) -> str:
    rows = [
        (each["what"], *spread_cells(each, 4), each["unit"]) for each in found["metrics"].values()
    ]
    return table_html(("", *SPREAD, "unit"), rows, "spread of the metrics")


def _distributions(campaign: Campaign, found: dict[str, Any]) -> go.Figure:
    names = [*found["metrics"]]
    titles = [_title(name) for name in names]
    figure = make_subplots(-(-len(names) // _ACROSS), _ACROSS, subplot_titles=titles)
    for place, name in enumerate(names):
        scale = reading_of(name).scale
        values = [scale * row[name] for row in campaign.rows if row.get(name) is not None]
        bars = go.Histogram(x=values, marker_color=COLOURS[0], name=titles[place])
        figure.add_trace(bars, place // _ACROSS + 1, place % _ACROSS + 1)
    height = _HEIGHT * -(-len(names) // _ACROSS)
    figure.update_layout(**LAYOUT, height=height, showlegend=False)
    figure.update_yaxes(title_text="runs", col=1)
    return figure


def _sensitivity_parts(campaign: Campaign, found: dict[str, Any]) -> list[str]:
    axes, metrics = [*found["sensitivities"]], [*found["metrics"]]
    tests = sum(len(each) for each in found["sensitivities"].values())

    def cell(axis: str, metric: str) -> str:
        entry = found["sensitivities"][axis].get(metric)
        # Bonferroni: of all cells together, one in twenty tables marks a chance.
        is_certain = entry is not None and entry["p"] < 0.05 / tests
        return f"{entry['rho']:+.2f}" if is_certain else "·"

    rows = [(reading_of(each).name, *(cell(axis, each) for axis in axes)) for each in metrics]
    heads = ("", *axes)
    return [
        "<h2>What moves them</h2>",
        "<p>Spearman's rank correlation, −1 to 1; a dot where chance explains it.</p>",
        table_html(heads, rows, "rank correlations"),
        scrolled(figure_html(_scatter(campaign, axes, metrics)), "a metric over an axis"),
    ]


def _scatter(campaign: Campaign, axes: Sequence[str], metrics: Sequence[str]) -> go.Figure:
    """Return each metric over each axis, one at a time, by a menu."""
    figure, buttons = go.Figure(), []
    pairs = [(axis, metric) for axis in axes for metric in metrics]
    for place, (axis, metric) in enumerate(pairs):
        shown = [row for row in campaign.rows if row.get(metric) is not None]
        scale = reading_of(metric).scale
        figure.add_scatter(
            x=[row.get(axis) or 0.0 for row in shown],
            y=[scale * row[metric] for row in shown],
            text=[f"run {row['run']}" for row in shown],
            mode="markers",
            marker_color=COLOURS[0],
            visible=place == 0,
        )
        visible = [each == place for each in range(len(pairs))]
        titles = {"xaxis.title.text": axis, "yaxis.title.text": _title(metric)}
        label = f"{reading_of(metric).name} over {axis}"
        buttons.append({"label": label, "method": "update", "args": [{"visible": visible}, titles]})
    menu = {"buttons": buttons, "x": 0.0, "xanchor": "left", "y": 1.12, "yanchor": "bottom"}
    figure.update_layout(**LAYOUT, height=480, showlegend=False, updatemenus=[menu])
    figure.update_xaxes(title_text=pairs[0][0])
    figure.update_yaxes(title_text=_title(pairs[0][1]))
    return figure


def _title(column: str) -> str:
    reading = reading_of(column)
    return f"{reading.name} [{reading.unit}]" if reading.unit else reading.name


def _worst_parts(found: dict[str, Any]) -> list[str]:
    if not found["worst"]:
        return []
    rows = []
    for each in found["worst"]:
        reading = reading_of(each["metric"])
        value = f"{reading.scale * each['value']:.4g} {reading.unit}"
        rows.append((str(each["run"]), value, each["command"]))
    what = reading_of(found["worst"][0]["metric"]).name
    return [
        "<h2>Worst runs</h2>",
        table_html(("run", what, "the command that repeats it"), rows, "worst runs"),
    ]


def _failure_parts(campaign: Campaign) -> list[str]:
    failed = campaign.failures
    if not failed:
        return []
    rows = [
        (str(row["run"]), row["status"], str(row["failure"]), campaign.command_of(row["run"]))
        for row in failed[:_MOST_LISTED]
    ]
    heads = ("run", "status", "why", "the command that repeats it")
    parts = ["<h2>Runs that failed</h2>", table_html(heads, rows, "failed runs")]
    more = len(failed) - _MOST_LISTED
    return parts + ([f"<p>And {more} more, in the table of runs.</p>"] if more > 0 else [])
