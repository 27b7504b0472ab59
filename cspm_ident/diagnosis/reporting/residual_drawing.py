"""A small drawing of one residual before and after, without any script."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.reporting.quantity import amount_words
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.offline_page import thinned

Array = NDArray[np.float64]

_WIDTH, _HEIGHT, _LEFT, _TOP, _FOOT = 520.0, 300.0, 64.0, 30.0, 34.0
# As many points as a line of this width shows.
_POINTS = 800
# Classes of a page's style, which has other colours for dark screens.
_BEFORE, _AFTER = "before", "after"


def residual_drawing(curve: Curve, words: str) -> str:
    """Return an SVG of a residual over time, before and after what was found.

    Args:
        curve: the residual.
        words: its quantity in words.
    """
    limit = float(np.abs(curve.before).max()) or 1.0
    span = float(curve.times[0]), float(curve.times[-1])
    lines = [_line(curve.times, curve.before, span, limit, _BEFORE, 1.0)]
    texts = [_text(_LEFT, 18.0, f"before {_size(curve.before, curve.unit)}", _BEFORE)]
    if curve.touched:
        lines.append(_line(curve.times, curve.after, span, limit, _AFTER, 1.3))
        after = f"after {_size(curve.after, curve.unit)}"
        texts.append(_text(0.5 * (_LEFT + _WIDTH), 18.0, after, _AFTER))
    middle = 0.5 * (_TOP + _HEIGHT - _FOOT)
    for value in (-limit, 0.0, limit):
        y = _y(np.array([value]), limit)[0]
        lines.append(f'<line class=grid x1="{_LEFT}" x2="{_WIDTH}" y1="{y:.1f}" y2="{y:.1f}"/>')
        texts.append(_text(_LEFT - 6.0, y + 4.0, f"{value:.2g}", "", "end"))
    for time in span:
        end = "start" if time == span[0] else "end"
        x = _LEFT if time == span[0] else _WIDTH
        texts.append(_text(x, _HEIGHT - 14.0, f"{time:.0f} s", "", end))
    turned = f' transform="rotate(-90 12 {middle:.0f})"'
    texts.append(_text(12.0, middle, f"residual [{curve.unit}]", "", "middle", turned))
    label = escape(f"residual of the {words} before and after", quote=True)
    return (
        f'<svg class=residual viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" role=img'
        f' aria-label="{label}">{"".join(lines)}{"".join(texts)}</svg>'
    )


def _size(values: Array, unit: str) -> str:
    return f"{amount_words(float(np.sqrt(np.mean(values**2))), unit)} RMS"


def _y(values: Array, limit: float) -> Array:
    inner = _HEIGHT - _TOP - _FOOT
    return np.asarray(_TOP + 0.5 * inner * (1.0 - values / limit))


def _line(
    times: Array, values: Array, span: tuple[float, float], limit: float, stage: str, width: float
) -> str:
    shown_times, shown = thinned(times, values, _POINTS)
    share = (shown_times - span[0]) / max(span[1] - span[0], 1e-9)
    x, y = _LEFT + (_WIDTH - _LEFT) * share, _y(np.clip(shown, -limit, limit), limit)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" class={stage} fill=none stroke-width="{width}"/>'


def _text(
    x: float, y: float, words: str, stage: str = "", anchor: str = "start", more: str = ""
) -> str:
    fill = f" class={stage} font-weight=bold" if stage else ""
    content = escape(words.replace("-", "−"))
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor={anchor}{fill}{more}>{content}</text>'
