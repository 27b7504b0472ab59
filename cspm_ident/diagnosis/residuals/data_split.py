"""Which rows are searched and which are held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cspm_ident.diagnosis.residuals.residual_equation import Equation

Parts = Sequence[Sequence[Equation]]

# Of a recording that has to serve as its own held-out data.
SEARCHED_SHARE = 0.7
GAP_SHARE = 0.02


def whole_part(parts: Parts) -> Parts:
    """Return what is searched where other recordings are held out."""
    return parts


def first_part(parts: Sequence[Sequence[Equation]]) -> list[list[Equation]]:
    """Return what is searched where nothing else is held out."""
    return [[e.within(-np.inf, _cut(part, 0.0)) for e in part] for part in parts]


def last_part(parts: Sequence[Sequence[Equation]]) -> list[list[Equation]]:
    """Return the rest, after a gap."""
    return [[e.within(_cut(part, GAP_SHARE), np.inf) for e in part] for part in parts]


def _cut(equations: Sequence[Equation], beyond: float) -> float:
    start, end = span_of(equations)
    return start + (SEARCHED_SHARE + beyond) * (end - start)


def span_of(equations: Sequence[Equation]) -> tuple[float, float]:
    """Return the earliest and the latest time of any row [s]."""
    times = [e.times for e in equations if len(e.times)]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)
