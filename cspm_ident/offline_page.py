"""Report pages of one HTML file that needs no network, and the lines drawn on them."""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.offline import get_plotlyjs

Array = NDArray[np.float64]

# Orange and blue, which colour-blind readers tell apart, as in grey by lightness; what was measured
# lies below, wide and pale. Dark pages have lighter ones.
BEFORE, AFTER, MEASURED = "#d9660a", "#0b5cad", "#9ecae9"

# Points per line: with the extremes of what lies between them, no spike is lost.
POINTS = 4000
LAYOUT = {"template": "plotly_white", "margin": {"t": 80, "l": 70, "r": 10}}
# Legends above or below, so that narrow screens have the width for the lines.
LEGEND = {"orientation": "h", "yref": "container"}
BELOW = {**LAYOUT, "legend": {**LEGEND, "y": 0.0, "yanchor": "bottom"}}

_STYLE = """<style>
:root {color-scheme: light dark; --back: #fff; --text: #222; --line: #ddd; --accent: #0b5cad;
  --mark: #b3003c; --before: #d9660a; --after: #0b5cad; --measured: #9ecae9}
@media (prefers-color-scheme: dark) {:root {--back: #14181d; --text: #e6eaef; --line: #3a444f;
  --accent: #78b4f5; --mark: #ff7a9c; --before: #ff9248; --after: #78b4f5; --measured: #46657f}}
.before {--colour: var(--before)}
.after {--colour: var(--after)}
body {font-family: sans-serif; margin: 2em auto; max-width: 1400px; padding: 0 1em;
  color: var(--text); background: var(--back)}
h1 {font-size: 1.5em; overflow-wrap: anywhere}
h2 {font-size: 1.2em; margin-top: 2em}
a {color: var(--accent)}
ul {padding-left: 1.2em; line-height: 1.5}
code {overflow-wrap: anywhere}
.verdict {font-size: 1.15em; line-height: 1.5; border-left: 6px solid var(--accent);
  padding: 0.2em 1em; overflow-wrap: anywhere}
summary {cursor: pointer; padding: 0.4em 0; font-weight: bold}
:focus-visible {outline: 3px solid var(--accent); outline-offset: 2px}
.wide {overflow-x: auto}
table {border-collapse: collapse; margin: 1em 0; white-space: nowrap}
td, th {padding: 0.2em 0.8em; text-align: right; border-bottom: 1px solid var(--line)}
td:first-child, th:first-child, .text {text-align: left}
</style>"""
# The text is on the screen before the script that draws is unpacked. Folded plots wait.
_DRAWING = """<script>
const unpacked = async () => {
  const packed = atob(document.getElementById("plotly").textContent);
  const bytes = Uint8Array.from(packed, letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
};
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const lines = {"#d9660a": "--before", "#0b5cad": "--after", "#9ecae9": "--measured"};
const coloured = layout => {
  Object.assign(layout, {paper_bgcolor: css("--back"), plot_bgcolor: css("--back")});
  layout.font = {...layout.font, color: css("--text")};
  for (const name of Object.keys(layout).filter(key => /^[xy]axis/.test(key))) {
    layout[name] = {...layout[name], gridcolor: css("--line"), zerolinecolor: css("--line")};
  }
  return layout;
};
const drawn = async place => {
  let text = place.nextElementSibling.textContent;
  for (const [light, name] of Object.entries(lines)) text = text.replaceAll(light, css(name));
  const {data, layout} = JSON.parse(text);
  await Plotly.newPlot(place, data, coloured(layout), {responsive: true});
  place.dispatchEvent(new CustomEvent("drawn", {bubbles: true}));
};
setTimeout(async () => {
  const script = document.createElement("script");
  script.textContent = await unpacked();
  document.head.append(script);
  for (const place of document.querySelectorAll(".plotly-graph-div")) {
    const fold = place.closest("details:not([open])");
    if (fold) fold.addEventListener("toggle", () => drawn(place), {once: true});
    else await drawn(place);
  }
}, 0);
</script>"""
_PLOT = "plotly-graph-div"


def write_offline_page(path: Path, title: str, parts: Iterable[str]) -> None:
    """Write one HTML file of a title and what comes below it.

    Raises:
        OSError: the file cannot be written.
    """
    body = "\n".join(parts)
    drawing = (_plotly(), _DRAWING) if _PLOT in body else ()
    whole = [
        "<!doctype html><html lang=en><head><meta charset=utf-8>",
        "<meta name=viewport content='width=device-width, initial-scale=1'>",
        f"<title>{escape(title)}</title>",
        _STYLE,
        f"</head><body><main><h1>{escape(title)}</h1>",
        body,
        "</main>",
        *drawing,
        "</body></html>",
    ]
    path.write_text("\n".join(whole), encoding="utf-8")


def table_html(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    label: str,
    links: Sequence[str] = (),
) -> str:
    """Return a table that scrolls sideways, by keyboard too; the first column names each row.

    Args:
        heads: of the columns.
        rows: their cells.
        label: what the table is, for readers that do not see it.
        links: where the first cell of each row leads; none: nowhere.
    """
    body = [[_cell("td", cell, text=not _begins_as_number(cell)) for cell in row] for row in rows]
    for cells, link in zip(body, links, strict=False):
        open_tag, _, rest = cells[0].partition(">")
        content = rest.removesuffix("</td>")
        cells[0] = f'{open_tag}><a href="{escape(link, quote=True)}">{content}</a></td>'
    of_text = [all(" class=text" in row[i] for row in body) for i in range(len(heads))]
    top = [_cell("th scope=col", *each) for each in zip(heads, of_text, strict=True)]
    lines = ["<tr>" + "".join(cells) + "</tr>" for cells in (top, *body)]
    return scrolled(f"<table>{''.join(lines)}</table>", label)


def scrolled(content: str, label: str) -> str:
    """Return content that is wider than some screens, in a region that scrolls by keyboard too."""
    name = escape(label, quote=True)
    return f'<div class=wide tabindex=0 role=region aria-label="{name}">{content}</div>'


def _cell(tag: str, content: str, text: bool) -> str:
    kind = " class=text" if text else ""
    return f"<{tag}{kind}>{escape(content)}</{tag.split()[0]}>"


def _begins_as_number(content: str) -> bool:
    return content.lstrip("−-")[:1].isdigit() or not content


def figure_html(figure: go.Figure) -> str:
    """Return a figure as HTML; `write_offline_page` adds once what draws all of them."""
    height = figure.layout.height or 450
    data = str(figure.to_json()).replace("<", "\\u003c")
    return (
        f'<div class={_PLOT} style="height:{height}px;width:100%"></div>'
        f"<script type=application/json>{data}</script>"
    )


@cache
def _plotly() -> str:
    """Return the script that draws, packed to 2 of its 5 MB."""
    packed = b64encode(gzip.compress(get_plotlyjs().encode(), mtime=0)).decode()
    return f"<script type=text/plain id=plotly>{packed}</script>"


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
