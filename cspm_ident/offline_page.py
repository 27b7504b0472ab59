"""Report pages of one HTML file that needs no network, and the lines drawn on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Points per line: with the extremes of what lies between them, no spike is lost.
POINTS = 4000
LAYOUT = {"template": "plotly_white", "margin": {"t": 80, "l": 70, "r": 10}}
# Legends above or below, so that narrow screens have the width for the lines.
LEGEND = {"orientation": "h", "yref": "container"}
BELOW = {**LAYOUT, "legend": {**LEGEND, "y": 0.0, "yanchor": "bottom"}}

_STYLE = """<style>
body {font-family: sans-serif; margin: 2em auto; max-width: 1400px; padding: 0 1em; color: #222}
h1 {font-size: 1.5em; overflow-wrap: anywhere}
h2 {font-size: 1.2em; margin-top: 2em}
ul {padding-left: 1.2em; line-height: 1.5}
code {overflow-wrap: anywhere}
:focus-visible {outline: 3px solid #1f77b4; outline-offset: 2px}
.wide {overflow-x: auto}
table {border-collapse: collapse; margin: 1em 0; white-space: nowrap}
td, th {padding: 0.2em 0.8em; text-align: right; border-bottom: 1px solid #ddd}
td:first-child, th:first-child, .text {text-align: left}
</style>"""


def write_offline_page(path: Path, title: str, parts: Iterable[str]) -> None:
    """Write one HTML file of a title and what comes below it.

    Raises:
        OSError: the file cannot be written.
    """
    whole = [
        "<!doctype html><html lang=en><head><meta charset=utf-8>",
        "<meta name=viewport content='width=device-width, initial-scale=1'>",
        f"<title>{escape(title)}</title>",
        _STYLE,
        f"</head><body><h1>{escape(title)}</h1>",
        *parts,
        "</body></html>",
    ]
    path.write_text("\n".join(whole), encoding="utf-8")


def table_html(heads: Sequence[str], rows: Iterable[Sequence[str]], label: str) -> str:
    """Return a table that scrolls sideways, by keyboard too; the first column names each row."""
    body = [[_cell("td", cell, text=not _begins_as_number(cell)) for cell in row] for row in rows]
    of_text = [all(" class=text" in row[i] for row in body) for i in range(len(heads))]
    top = [_cell("th scope=col", *each) for each in zip(heads, of_text, strict=True)]
    lines = ["<tr>" + "".join(cells) + "</tr>" for cells in (top, *body)]
    name = escape(label, quote=True)
    return (
        f'<div class=wide tabindex=0 role=region aria-label="{name}">'
        f"<table>{''.join(lines)}</table></div>"
    )


def _cell(tag: str, content: str, text: bool) -> str:
    kind = " class=text" if text else ""
    return f"<{tag}{kind}>{escape(content)}</{tag.split()[0]}>"


def _begins_as_number(content: str) -> bool:
    return content.lstrip("−-")[:1].isdigit() or not content


def figure_html(figure: go.Figure, *, script: bool) -> str:
    """Return a figure as HTML; the first on a page brings the script that draws all of them."""
    return str(
        figure.to_html(full_html=False, include_plotlyjs=script, config={"responsive": True})
    )


def thinned(times: Array, values: Array, points: int = POINTS) -> tuple[Array, Array]:
    """Return at most about so many points that keep each stretch's least and greatest value.

    Args:
        times: shape (n,) [s].
        values: shape (n,).
        points: about how many to keep.
    """
    if len(values) <= points:
        return times, values
    edges = np.linspace(0, len(values), points // 2 + 1).astype(int)
    # Rows of equal length, the shorter ones filled up with their own first value.
    inside = np.arange(np.diff(edges).max()) < np.diff(edges)[:, None]
    places = np.where(inside, edges[:-1, None] + np.arange(inside.shape[1]), edges[:-1, None])
    rows = values[places]
    pairs = np.sort([np.argmin(rows, axis=1), np.argmax(rows, axis=1)], axis=0)
    chosen = np.unique(edges[:-1] + pairs)
    return times[chosen], values[chosen]
