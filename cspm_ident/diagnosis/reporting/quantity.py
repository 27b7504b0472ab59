"""A quantity with its interval and unit, as text."""

from __future__ import annotations

from math import floor, isfinite, log10

# Smaller quantities get a prefix.
_SMALL = 0.1
# Powers of 1000; kilograms are converted to grams before they get a prefix.
_PREFIXES = ("", "m", "µ", "n")
# Beyond ten times the whole, a share says no more than that.
_MOST_PERCENT = 1000
# Share of an interval's width by which an interval is asymmetric, and both ends are given.
_ASLANT = 0.1


def amount_words(value: float, unit: str, ends: tuple[float, float] | None = None) -> str:
    """Return `30.9 mN·m`, with an interval `30.91 ± 0.14 mN·m`.

    Args:
        value: in `unit`.
        unit: SI; `1` for none.
        ends: of its interval; an asymmetric one is given as `30.9 (30.2 to 34) mN·m`.
    """
    low, high = ends or (value, value)
    scale, name = _scaled(max(abs(value), abs(low), abs(high)), unit)
    value, low, high = (each * scale for each in (value, low, high))
    up, down = high - value, value - low
    if not 0.0 < up + down < float("inf"):
        return f"{value:.3g}{name}"
    if abs(up - down) > _ASLANT * (up + down):
        return f"{value:.4g} ({low:.4g} to {high:.4g}){name}"
    half = 0.5 * (up + down)
    digits = max(0, 1 - floor(log10(half)))
    return f"{value:.{digits}f} ± {half:.{digits}f}{name}"


def percent_words(size: float, whole: float) -> str:
    """Return `2.6 %`, a size as a share of a whole; `over 1000 %` where that says no more."""
    percent = 100.0 * size / max(whole, 1e-300)
    if percent >= _MOST_PERCENT:
        return f"over {_MOST_PERCENT} %"
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"


def _scaled(size: float, unit: str) -> tuple[float, str]:
    """Return the factor for the usual prefix of a quantity of this size, and the prefixed unit."""
    if unit == "1" or not 0.0 < size < _SMALL or not isfinite(size):
        return 1.0, "" if unit == "1" else f" {unit}"
    base, scale = unit, 1.0
    if unit.startswith("kg"):
        base, scale = unit[1:], 1e3
    power = 0
    while size * scale < _SMALL and power < len(_PREFIXES) - 1:
        scale, power = 1e3 * scale, power + 1
    return scale, f" {_PREFIXES[power]}{base}"
