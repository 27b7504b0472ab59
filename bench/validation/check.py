"""A measurement with bounds that were fixed before it was made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple


class Finding(NamedTuple):
    """One measured quantity.

    Attributes:
        quantity: what it is.
        found: as it is printed.
        allowed: as it is printed.
        holds: whether it is within its bounds.
    """

    quantity: str
    found: str
    allowed: str
    holds: bool


class Check(NamedTuple):
    """A measurement of some minutes.

    Attributes:
        name: its heading.
        what: what is measured, and how often.
        measure: makes the measurement.
    """

    name: str
    what: str
    measure: Callable[[], Sequence[Finding]]


def at_least(quantity: str, found: int, least: int, total: int) -> Finding:
    """Return a count that must not be smaller."""
    return Finding(quantity, f"{found} of {total}", f"≥ {least}", found >= least)


def at_most(quantity: str, found: int, most: int, total: int) -> Finding:
    """Return a count that must not be larger."""
    return Finding(quantity, f"{found} of {total}", f"≤ {most}", found <= most)
