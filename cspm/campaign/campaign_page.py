"""The page of a campaign: metrics over what is varied, distributions, worst and failed runs."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from cspm.campaign.campaign import Campaign
from cspm.campaign.campaign_folder import PAGE
from cspm.campaign.metric_figures import metric_figure
from cspm.campaign.summary import SPREAD, axes_of, reading_of, spread_cells
from cspm_ident.offline_page import AFTER, LAYOUT, figure_html, table_html, write_offline_page

_HEIGHT = 260
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
    if found["sensitivities"]:
        parts += _metric_parts(campaign, found) + _sensitivity_parts(found)
    if found["metrics"]:
        drawn = figure_html(_distributions(campaign, found))
        parts += ["<h2>How they are spread</h2>", _spread_table(found)]
        parts.append(f"<details><summary>Distributions</summary>{drawn}</details>")
    if found["verdicts"]:
        rows = [(name, str(count)) for name, count in found["verdicts"].items()]
        parts += ["<h2>Verdicts</h2>", table_html(("verdict", "runs"), rows, "verdicts")]
    parts += _worst_parts(found) + _failure_parts(campaign)
    path = campaign.folder / PAGE
    write_offline_page(path, _page_title(campaign, found), parts)
    return path


def _page_title(campaign: Campaign, found: dict[str, Any]) -> str:
    """Return the campaign and what moves its first metric most, in a line."""
    name = f"Campaign {campaign.file.name}"
    metric = next(iter(found["metrics"]), None)
    ranked = [
        (abs(each[metric]["rho"]), axis)
        for axis, each in found["sensitivities"].items()
        if metric in each
    ]
    if metric is None or not ranked:
        return f"{name}: {found['ended']} of {found['runs']} runs"
    share, axis = max(ranked)
    what = reading_of(metric).name
    return f"{name}: {what} follows {axis} most (rank correlation {share:.2f})"


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
    # One below the other: beside each other their titles overlap on a phone.
    figure = make_subplots(len(names), 1, subplot_titles=titles)
    for place, name in enumerate(names):
        scale = reading_of(name).scale
        values = [scale * row[name] for row in campaign.rows if row.get(name) is not None]
        bars = go.Histogram(x=values, marker_color=AFTER, name=titles[place])
        figure.add_trace(bars, place + 1, 1)
    figure.update_layout(**LAYOUT, height=_HEIGHT * len(names), showlegend=False)
    figure.update_yaxes(title_text="runs")
    return figure


def _metric_parts(campaign: Campaign, found: dict[str, Any]) -> list[str]:
    """Return each metric over each varied value; the first metric open, the others folded."""
    axes, parts = [*found["sensitivities"]], ["<h2>What moves them</h2>"]
    parts.append("<p>Points are runs; diamonds are means of runs, with their 95 % intervals.</p>")
    for place, metric in enumerate(found["metrics"]):
        drawn = figure_html(metric_figure(campaign.rows, metric, axes))
        opened = " open" if place == 0 else ""
        said = escape(reading_of(metric).name)
        parts.append(f"<details{opened}><summary>{said}</summary>{drawn}</details>")
    return parts


def _sensitivity_parts(found: dict[str, Any]) -> list[str]:
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
        "<p>Spearman's rank correlation, −1 to 1; a dot where chance explains it.</p>",
        table_html(heads, rows, "rank correlations"),
    ]


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
