"""Where a finding shows: of which driver's values, and how little of the data has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.equation import Equation

Array = NDArray[np.float64]

# Of what a finding takes from the squared residual, that a region has to hold.
HELD = 0.9
# Of the data: what shows in more of it shows everywhere.
_WIDEST = 0.5


class Region(NamedTuple):
    """Values of a signal at which a finding shows.

    Attributes:
        driver: the signal, with its unit.
        low, high: ends of the interval.
        share: of the data that lies in it.
        held: share of what the finding takes from the squared residual that lies in it.
    """

    driver: str
    low: float
    high: float
    share: float
    held: float


def region_of(
    parts: Sequence[Sequence[Equation]],
    own: Sequence[Candidate],
    weights: Mapping[Candidate, Array],
) -> Region | None:
    """Return the narrowest region that holds most of a finding; None where it shows everywhere.

    Args:
        parts: equations of what was searched, in units of their noise.
        own: the finding's candidates.
        weights: of all that was found.
    """
    gains: dict[str, list[Array]] = {}
    values: dict[str, list[Array]] = {}
    for part in parts:
        for equation in part:
            taken = _taken(equation, own, weights)
            if taken is None:
                continue
            for name, signal in equation.signals.items():
                gains.setdefault(name, []).append(taken)
                values.setdefault(name, []).append(signal)
    regions = [
        region
        for name in gains
        if (region := _narrowest(name, np.concatenate(values[name]), np.concatenate(gains[name])))
    ]
    narrowest = min(regions, key=lambda region: region.share, default=None)
    return narrowest if narrowest is not None and narrowest.share <= _WIDEST else None


def _taken(
    equation: Equation, own: Sequence[Candidate], weights: Mapping[Candidate, Array]
) -> Array | None:
    """Return by how much a finding lowers each row's squared residual, (k,)."""
    added = [equation.columns[c] @ weights[c] for c in own if c in equation.columns]
    if not added:
        return None
    left = equation.target - sum(
        equation.columns[c] @ w for c, w in weights.items() if c in equation.columns
    )
    return np.asarray(((left + sum(added)) ** 2 - left**2).sum(axis=1))


def _narrowest(driver: str, values: Array, gains: Array) -> Region | None:
    """Return the shortest run of a signal's sorted values that holds most of the gain."""
    order = np.argsort(values)
    held = np.concatenate([[0.0], np.cumsum(gains[order])])
    if held[-1] <= 0.0:
        return None
    reach = np.maximum.accumulate(held)
    ends = np.searchsorted(reach, held[:-1] + HELD * held[-1])
    starts = np.flatnonzero(ends < len(held))
    if not len(starts):
        return None
    best = int(starts[np.argmin(ends[starts] - starts)])
    end = int(ends[best])
    low, high = values[order[best]], values[order[end - 1]]
    share = (end - best) / len(values)
    kept = (held[end] - held[best]) / held[-1]
    return Region(driver, float(low), float(high), share, float(kept))
