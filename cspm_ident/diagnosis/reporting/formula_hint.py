"""A simple formula for a free function, as a hint only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]

# Periods that are tried, as multiples of a turn, and from where on a gear may be the reason.
_RATIOS, _GEARED = 400, 2.0

_FORMS: dict[str, Callable[[Array], Array]] = {
    "{x}": lambda x: x,
    "|{x}|": np.abs,
    "sign({x})": np.sign,
    "({x})²": np.square,
    "{x}·|{x}|": lambda x: x * np.abs(x),
    "({x})³": lambda x: x**3,
    "√|{x}|": lambda x: np.sqrt(np.abs(x)),
}


def sketch(
    knots: Array, values: Array, name: str, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> str | None:
    """Return the simplest formula, plus a constant, that fits a shape; None if none does.

    Args:
        knots: of the signal, shape (k,).
        values: of the shape there, (k,).
        name: of the signal, without unit.
        thresholds: `minor_share`.
    """
    spread = float(np.sum((values - values.mean()) ** 2))
    if spread <= 0.0:
        return None
    best: tuple[float, str] | None = None
    for form, function in _FORMS.items():
        table = np.column_stack([function(knots), np.ones(len(knots))])
        found = np.linalg.lstsq(table, values, rcond=None)[0]
        share = 1.0 - float(np.sum((values - table @ found) ** 2)) / spread
        if share >= 1.0 - thresholds.minor_share and (best is None or share > best[0]):
            best = share, f"{found[0]:.3g}·{form.format(x=name)}"
    return _wave(knots, values, name, thresholds) if best is None else best[1]


def _wave(knots: Array, values: Array, name: str, thresholds: Thresholds) -> str | None:
    """Return a wave of an angle with a period of its own, where the range holds half of one.

    Gravity on a joint is such a wave of the motor's angle where the file lacks the gear ratio. A
    period of fewer than four knots would fit anything.
    """
    shortest = max(1.0, 2.0 * float(np.diff(knots).max()) / np.pi)
    longest = float(np.ptp(knots)) / np.pi
    if name != "angle" or longest < shortest:
        return None
    fits = [
        (*_fitted_wave(knots, values, ratio), ratio)
        for ratio in np.geomspace(shortest, longest, _RATIOS)
    ]
    left, size, ratio = min(fits)
    if left > thresholds.minor_share * float(np.sum((values - values.mean()) ** 2)):
        return None
    gear = " (is gear_ratio missing?)" if ratio > _GEARED else ""
    return f"{size:.3g}·cosine of {name}/{ratio:.3g}{gear}"


def _fitted_wave(knots: Array, values: Array, ratio: float) -> tuple[float, float]:
    """Return the squares that a wave leaves of a shape, and its amplitude."""
    waves = np.column_stack([np.cos(knots / ratio), np.sin(knots / ratio), np.ones(len(knots))])
    found = np.linalg.lstsq(waves, values, rcond=None)[0]
    return float(np.sum((values - waves @ found) ** 2)), float(np.hypot(found[0], found[1]))


def is_even(knots: Array, values: Array, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> bool:
    """Return whether a shape is even, over the range that both sides of zero share.

    Args:
        knots: of the signal, ascending, shape (k,).
        values: of the shape there, (k,).
        thresholds: `minor_share` and `majority_share`.
    """
    reach = min(-float(knots[0]), float(knots[-1]))
    if reach < thresholds.majority_share * float(np.max(np.abs(knots))):
        return False
    points = np.linspace(-reach, reach, 41)
    whole = np.interp(points, knots, values)
    whole = whole - whole.mean()
    odd = 0.5 * (whole - whole[::-1])
    most = thresholds.minor_share * float(np.sum(whole**2))
    return float(np.sum(odd**2)) <= most
