"""Split of the rows into a search part and a hold-out part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Parts = Sequence[Sequence[Equation]]


def whole_part(parts: Parts) -> Parts:
    """Return the search part where other recordings are the hold-out."""
    return parts


def first_part(
    parts: Sequence[Sequence[Equation]], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> list[list[Equation]]:
    """Return the search part where there is no other recording as hold-out."""
    share = thresholds.searched_share
    return [[e.within(-np.inf, _cut(part, share)) for e in part] for part in parts]


def last_part(
    parts: Sequence[Sequence[Equation]], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> list[list[Equation]]:
    """Return the hold-out part, after a gap."""
    share = thresholds.searched_share + thresholds.gap_share
    return [[e.within(_cut(part, share), np.inf) for e in part] for part in parts]


def _cut(equations: Sequence[Equation], share: float) -> float:
    start, end = span_of(equations)
    return start + share * (end - start)


def span_of(equations: Sequence[Equation]) -> tuple[float, float]:
    """Return the earliest and the latest time of any row [s]."""
    times = [e.times for e in equations if len(e.times)]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)
