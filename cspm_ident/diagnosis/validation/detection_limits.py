"""From which size on recordings would have shown an effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as t_distribution

from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.search import Search

Array = NDArray[np.float64]


class Limit(NamedTuple):
    """The least that would have been told of an effect on one element.

    Attributes:
        effect: its id.
        element: on which.
        parameter: which of its parameters.
        least: how far this has to be from where the effect is absent, in `unit`.
        unit: of the parameter.
        possible: whether the catalogue allows so much; if not, the recordings cannot show it.
    """

    effect: str
    element: str
    parameter: str
    least: float
    unit: str
    possible: bool


def detection_limits(search: Search, kept: Sequence[Finding]) -> tuple[Limit, ...]:
    """Return the limit of every effect of one coefficient on every element that shows it.

    So large that its test over blocks is as sure as the search asks and that it takes as large a
    share of a residual, beside what was found. Of several shapes the one that shows best.
    """
    base = search.fits.columns(each.hypothesis for each in kept)
    best: dict[tuple[str, str], Limit] = {}
    for candidate in search.heard:
        columns = search.gram.columns_of([candidate])
        if (
            len(columns) != 1
            or candidate.effect.signature.coefficients
            or np.isin(columns, base).any()
        ):
            continue
        limit = _limit(candidate, _least(search, candidate, base))
        key = limit.effect, limit.element
        if key not in best or limit.least < best[key].least:
            best[key] = limit
    return tuple(sorted(best.values()))


def _least(search: Search, candidate: Candidate, base: NDArray[np.intp]) -> float:
    """Return the least weight that would be told."""
    sums, columns = search.sums, search.gram.columns_of([candidate])
    error = float(np.sqrt(sums.covariance(base, columns)[0, 0]))
    chance = search.significance.below(candidate.effect)
    sure = error * float(t_distribution.ppf(1.0 - chance / 2.0, max(1, sums.blocks - 1)))
    share = search.thresholds.material_share
    return max(sure, _material(search.gram, base, sums.weights(base), columns, share))


def _material(
    gram: BlockGram,
    base: NDArray[np.intp],
    weights: Array,
    columns: NDArray[np.intp],
    share: float,
) -> float:
    """Return the weight that takes a share of the squares of the residual where it shows most."""
    left = gram.left(base, weights)
    least = np.inf
    for place in gram.places:
        at = np.flatnonzero(np.isin(place.columns, columns))
        if not len(at):
            continue
        beside = np.flatnonzero(np.isin(place.columns, base))
        cross = place.whole[np.ix_(beside, at)]
        inverse = np.linalg.pinv(place.whole[np.ix_(beside, beside)], hermitian=True)
        own = float(place.whole[at[0], at[0]] - (cross.T @ inverse @ cross)[0, 0])
        if own > 0.0:
            ratio = share / (1.0 - share)
            least = min(least, float(np.sqrt(ratio * max(left[place.place], 0.0) / own)))
    return least


def _limit(candidate: Candidate, least: float) -> Limit:
    (parameter,) = candidate.effect.linear
    absent = parameter.absent or 0.0
    possible = bool(absent + least <= parameter.maximum or absent - least >= parameter.minimum)
    return Limit(
        candidate.effect_id, candidate.element, parameter.name, least, parameter.unit, possible
    )
