"""Region of a finding: the range of a signal that holds most of its gain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Region
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]

# Number of bins of a signal, each with equally many values.
_BINS = 50


def region_of(
    parts: Sequence[Sequence[Equation]],
    own: Sequence[Candidate],
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Region | None:
    """Return the narrowest region that holds most of a finding's gain.

    The result is None where the gain is spread over the whole range.

    Args:
        parts: equations of the searched data, in units of their noise.
        own: the finding's candidates.
        weights: of all findings.
        thresholds: those of regions.
    """
    gains: dict[str, list[Array]] = {}
    values: dict[str, list[Array]] = {}
    for part in parts:
        for equation in part:
            taken = _taken(equation, own, weights)
            if taken is None:
                continue
            for name, signal in equation.signals.items():
                # The onset is reported separately; time would only show when the machine moved.
                if Driver(equation.place, name).of_time:
                    continue
                gains.setdefault(name, []).append(taken)
                values.setdefault(name, []).append(signal)
    regions = [
        region
        for name in gains
        if (
            region := _narrowest(
                name, np.concatenate(values[name]), np.concatenate(gains[name]), thresholds
            )
        )
    ]
    narrowest = min(regions, key=lambda region: region.share, default=None)
    if narrowest is None or narrowest.share > thresholds.majority_share:
        return None
    return narrowest


def _taken(
    equation: Equation, own: Sequence[Candidate], weights: Mapping[Candidate, Array]
) -> Array | None:
    """Return the reduction of each row's squared residual by a finding, (k,).

    The result is None if the finding does not act in the equation.
    """
    added = [equation.columns[c] @ weights[c] for c in own if c in equation.columns]
    if not added:
        return None
    left = equation.target - sum(
        equation.columns[c] @ w for c, w in weights.items() if c in equation.columns
    )
    return np.asarray(((left + sum(added)) ** 2 - left**2).sum(axis=1))


def _narrowest(driver: str, values: Array, gains: Array, thresholds: Thresholds) -> Region | None:
    """Return the fewest adjacent bins of a signal that hold most of the gain, or None.

    It is None if the loss in other bins is too large a share of the gain.
    """
    order = np.array_split(np.argsort(values), _BINS)
    sums = np.array([gains[rows].sum() for rows in order])
    held = np.concatenate([[0.0], np.cumsum(sums)])
    if -sums[sums < 0.0].sum() >= thresholds.minor_share * held[-1]:
        return None
    between = (held[None, :] - held[:, None]) / held[-1]
    starts, ends = np.nonzero(np.triu(between >= (1.0 - thresholds.minor_share)))
    best = int(np.argmin(ends - starts))
    first, last = int(starts[best]), int(ends[best])
    low, high = values[order[first][0]], values[order[last - 1][-1]]
    share = sum(len(rows) for rows in order[first:last]) / len(values)
    return Region(driver, float(low), float(high), share, float(between[first, last]))
