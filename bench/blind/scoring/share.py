"""A share of cases, with the interval that so few cases allow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from scipy.stats import binomtest


class Share(NamedTuple):
    """How many of how many.

    Attributes:
        hits: cases that count.
        cases: all.
        low, high: ends of the two-sided 95 % interval of Clopper and Pearson; 0 and 1 of no cases.
    """

    hits: int
    cases: int
    low: float
    high: float


def share(cases: Iterable[bool]) -> Share:
    """Return the share of true ones."""
    found = list(cases)
    return share_of(sum(found), len(found))


def share_of(hits: int, cases: int) -> Share:
    """Return the share of cases that were counted already."""
    if not cases:
        return Share(0, 0, 0.0, 1.0)
    interval = binomtest(hits, cases).proportion_ci(0.95, method="exact")
    return Share(hits, cases, float(interval.low), float(interval.high))


def upper_bound(hits: int, cases: int) -> float:
    """Return the one-sided 95 % upper bound of Clopper and Pearson; 1 of no cases."""
    if not cases:
        return 1.0
    test = binomtest(hits, cases, alternative="less")
    return float(test.proportion_ci(0.95, method="exact").high)


def share_words(found: Sequence[float]) -> str:
    """Return a share, as its fields or a list of them, as pages show it."""
    hits, cases, low, high = found
    if not cases:
        return "no cases"
    return (
        f"{100 * hits / cases:.0f} % ({hits:g} of {cases:g}; {100 * low:.0f} to {100 * high:.0f})"
    )
