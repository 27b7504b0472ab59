"""A threshold as a dataclass field: its default, unit, allowed range, meaning and basis."""

from __future__ import annotations

from dataclasses import field
from math import inf


def share(
    default: float, meaning: str, basis: str, *, low: float = 0.0, high: float = 1.0
) -> float:
    """Return a field for a share of something, unit 1, from 0 to 1 unless said otherwise."""
    return _bounded(default, "1", low, high, meaning, basis)


def sigmas(default: float, meaning: str, basis: str) -> float:
    """Return a field for a number of standard errors, 0 or more."""
    return _bounded(default, "standard errors", 0.0, inf, meaning, basis)


def ratio(default: float, meaning: str, basis: str, *, low: float = 0.0) -> float:
    """Return a field for a quotient of two like quantities, unit 1."""
    return _bounded(default, "1", low, inf, meaning, basis)


def quantity(
    default: float, unit: str, meaning: str, basis: str, *, low: float = 0.0, high: float = inf
) -> float:
    """Return a field for a quantity with a unit."""
    return _bounded(default, unit, low, high, meaning, basis)


def count(default: int, meaning: str, basis: str, *, low: int = 1) -> int:
    """Return a field for a whole number of things."""
    given = {"unit": "count", "low": low, "high": inf, "meaning": meaning, "basis": basis}
    return field(default=default, metadata=given)


def _bounded(default: float, unit: str, low: float, high: float, meaning: str, basis: str) -> float:
    given = {"unit": unit, "low": low, "high": high, "meaning": meaning, "basis": basis}
    return field(default=default, metadata=given)
