"""Each metric of a campaign over each varied value: runs, and means with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots
from scipy.stats import t as student

from cspm.campaign.summary import number_of, reading_of
from cspm_ident.offline_page import AFTER, BEFORE, LAYOUT

Array = NDArray[np.float64]
Row = Mapping[str, Any]

# Groups of runs that a mean is taken of, and least runs of one whose mean has an interval.
_GROUPS, _LEAST = 8, 3
_HEIGHT, _CONFIDENCE = 280, 0.95


class GroupMeans(NamedTuple):
    """Means of groups of runs that are neighbours in a varied value.

    Attributes:
        at: mean of the varied value, shape (g,).
        mean: of the metric, shape (g,).
        half: half width of the 95 % interval of the mean, shape (g,); NaN of too few runs.
    """

    at: Array
    mean: Array
    half: Array


def group_means(varied: Array, metric: Array) -> GroupMeans:
    """Return the means of a metric over groups of a varied value.

    A group is the runs of one value where there are few values, and otherwise neighbours, equally
    many in each.

    Args:
        varied: shape (n,).
        metric: shape (n,).
    """
    values, home = np.unique(varied, return_inverse=True)
    if len(values) > _GROUPS:
        rank = np.argsort(np.argsort(varied, kind="stable"), kind="stable")
        home = rank * min(_GROUPS, max(1, len(varied) // _LEAST)) // len(varied)
    groups = [home == group for group in range(int(home.max()) + 1)]
    at, mean = (np.array([v[group].mean() for group in groups]) for v in (varied, metric))
    return GroupMeans(at, mean, np.array([_half_width(metric[group]) for group in groups]))


def _half_width(values: Array) -> float:
    """Return half the width of the interval of a mean, by Student's distribution."""
    count = len(values)
    if count < _LEAST:
        return float("nan")
    factor = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, count - 1))
    return factor * float(values.std(ddof=1)) / sqrt(count)


def metric_figure(rows: Sequence[Row], metric: str, axes: Sequence[str]) -> go.Figure:
    """Return a metric over each varied value, one below the other, so that phones have room.

    Args:
        rows: of the campaign's table.
        metric: its column.
        axes: columns of the varied values, numbers.
    """
    figure = make_subplots(len(axes), 1, vertical_spacing=0.3 / len(axes))
    reading = reading_of(metric)
    for place, axis in enumerate(axes, 1):
        for each in _layers(rows, metric, axis):
            figure.add_trace(each, place, 1)
        figure.update_xaxes(title_text=axis, row=place, col=1)
    unit = f"[{reading.unit}]" if reading.unit else ""
    figure.update_yaxes(title_text=f"{reading.name}<br>{unit}", title_font_size=12)
    figure.update_layout(**LAYOUT, height=60 + _HEIGHT * len(axes), showlegend=False)
    figure.update_layout(margin_t=20)
    return figure


def _layers(rows: Sequence[Row], metric: str, axis: str) -> list[go.Scatter]:
    """Return the runs as points, and above them the means of groups with their intervals."""
    shown = [(number_of(row.get(axis)), row.get(metric), row["run"]) for row in rows]
    known = [each for each in shown if each[0] is not None and each[1] is not None]
    varied = np.array([each[0] for each in known], dtype=float)
    values = reading_of(metric).scale * np.array([each[1] for each in known], dtype=float)
    means = group_means(varied, values)
    return [
        go.Scatter(
            x=varied,
            y=values,
            text=[f"run {run}" for *_, run in known],
            name="run",
            mode="markers",
            marker={"color": AFTER, "size": 5, "opacity": 0.5},
        ),
        go.Scatter(
            x=means.at,
            y=means.mean,
            error_y={"type": "data", "array": np.nan_to_num(means.half), "color": BEFORE},
            name="mean, 95 %",
            mode="markers",
            marker={"color": BEFORE, "size": 9, "symbol": "diamond"},
        ),
    ]
