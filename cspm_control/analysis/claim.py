"""A published figure beside what is found here."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any, NamedTuple

# Numbers within a published one's rounding may differ from it by this in the last place.
ROUND_OFF = 1e-9


class Claim(NamedTuple):
    """A figure of the thesis and ours.

    Attributes:
        what: it is of.
        published: as the thesis gives it.
        low: the smallest number for which it holds.
        high: the largest.
        found: ours, by the way it was found.
    """

    what: str
    published: str
    low: float
    high: float
    found: Mapping[str, float]

    def holds(self, way: str) -> bool:
        """Return whether ours, found that way, is what was published."""
        return self.low - ROUND_OFF <= self.found[way] <= self.high + ROUND_OFF

    def data(self) -> dict[str, Any]:
        """Return the claim as plain data; None for what JSON has no number for."""
        return {
            "figure": self.what,
            "published": self.published,
            "holds_within": [_plain(self.low), _plain(self.high)],
            "found": {way: _plain(value) for way, value in self.found.items()},
            "holds": {way: self.holds(way) for way in self.found},
        }


def rounded(published: str) -> tuple[float, float]:
    """Return the ends of what rounds to a published decimal number, such as `0.74`."""
    half = 0.5 * 10.0 ** -len(published.partition(".")[2])
    return float(published) - half, float(published) + half


def _plain(value: float) -> float | None:
    return value if isfinite(value) else None
