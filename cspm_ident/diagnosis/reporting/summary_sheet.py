"""The first sheet of a diagnosis: all that one forwards, on one printed page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from cspm_ident.channel_words import channel_words
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.quantity import amount_words
from cspm_ident.diagnosis.reporting.residual_drawing import residual_drawing
from cspm_ident.diagnosis.reporting.statement import channel_of
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.offline_page import table_html
from cspm_sim.effects import catalogue

# Numbers on the sheet; the details have all.
_NUMBERS = 3
STYLE = """<style>
.pair {display: grid; gap: 1em;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 340px), 1fr))}
.pair figure {margin: 0}
figcaption {font-size: 0.95em}
.residual {width: 100%; height: auto; font-size: 14px}
.residual text {fill: var(--colour, var(--text))}
.residual polyline {stroke: var(--colour)}
.residual .grid {stroke: var(--line)}
@page {size: A4; margin: 14mm}
@media print {
  .details, nav {display: none}
  body {margin: 0; max-width: none; font-size: 11pt; color: #000; background: #fff}
  h1 {font-size: 15pt}
  .pair {grid-template-columns: 1fr 1fr}
  .pair svg {max-height: 85mm}
  .sheet {break-inside: avoid}
}
</style>"""


def summary_sheet(
    found: Diagnosis,
    data: Mapping[str, Any],
    verdict: str,
    where: str,
    curves: Sequence[Curve],
    step: Callable[[], str],
) -> str:
    """Return verdict, drawing, residual, numbers and next step.

    Args:
        found: the diagnosis.
        data: its `diagnosis.json`.
        verdict: its sentences as HTML.
        where: the section with the drawing of the machine, as HTML.
        curves: of the most important finding, the clearest first.
        step: gives what to do next, as HTML.
    """
    residual = ""
    if curves:
        component = f"/{curves[0].component}" if curves[0].component else ""
        words = channel_words(channel_of(curves[0]) + component)
        residual = (
            f"<figure>{residual_drawing(curves[0], words)}<figcaption>What the model leaves of the"
            f" {escape(words)} on data that was not searched.</figcaption></figure>"
        )
    return (
        f"<div class=sheet>{verdict}{_sureness(data)}<div class=pair>{where}{residual}</div>"
        f"{_numbers(data)}<p><b>Next:</b> {step()}</p></div>"
    )


def _sureness(data: Mapping[str, Any]) -> str:
    """Return the probability of the first finding in a sentence; empty where none is known."""
    first = next(iter(data["findings"]), None)
    if first is None or first["probability"] is None:
        return ""
    text = f"{100 * first['probability']:.0f} % likely, compared with the rival explanations."
    return f"<p>{escape(text)}</p>"


def _numbers(data: Mapping[str, Any]) -> str:
    rows = []
    for finding in data["findings"]:
        for each in finding["parameters"]:
            effect = catalogue()[finding["effect"]].words
            name = f"{each['name'].replace('_', ' ')} of {effect}"
            place = each["element"].replace("_", " ")
            ends = None if each["ci95"] is None else (each["ci95"][0], each["ci95"][1])
            value = amount_words(each["value"], each["unit"])
            interval = "none" if ends is None else _between(ends, each["unit"])
            rows.append((name, place, value, interval))
    heads = ("number", "on", "value", "95 % interval")
    return table_html(heads, rows[:_NUMBERS], "the most important numbers") if rows else ""


def _between(ends: tuple[float, float], unit: str) -> str:
    return f"{amount_words(ends[0], unit)} to {amount_words(ends[1], unit)}"
