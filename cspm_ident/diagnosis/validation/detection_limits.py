"""Detection limits: the smallest size of an effect that the recordings would have shown."""

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
from cspm_sim.effects import Effect, EffectParameter

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Limit(NamedTuple):
    """The detection limit of an effect on one element.

    Attributes:
        effect: id of the effect.
        element: name of the element.
        parameter: name of the parameter.
        least: smallest detectable distance from the value without the effect, in `unit`.
        unit: unit of the parameter.
        possible: whether the catalogue allows this size; if not, the recordings cannot show it.
    """

    effect: str
    element: str
    parameter: str
    least: float
    unit: str
    possible: bool


def detection_limits(search: Search, kept: Sequence[Finding]) -> tuple[Limit, ...]:
    """Return the limit of each parameter of every effect on every element that shows it.

    At the limit the effect, beside the findings, reaches the search's significance over blocks and
    its material share of a residual. Of several parameters each has its limit beside the others;
    one that a healthy machine has too has to exceed what that may have. Of several shapes, the one
    with the lowest limit counts.
    """
    base = search.fits.columns(each.hypothesis for each in kept)
    best: dict[tuple[str, str, str], Limit] = {}
    for candidate in search.heard:
        columns, effect = search.gram.columns_of([candidate]), candidate.effect
        if effect.signature.coefficients or np.isin(columns, base).any():
            continue
        for k, parameter in enumerate(effect.linear):
            beside = np.concatenate([base, np.delete(columns, k)])
            least = _least(search, effect, beside, columns[k : k + 1])
            limit = _limit(candidate, parameter, least)
            key = limit.effect, limit.element, limit.parameter
            if key not in best or limit.least < best[key].least:
                best[key] = limit
    return tuple(sorted(best.values()))


def _least(search: Search, effect: Effect, base: Index, column: Index) -> float:
    """Return the smallest weight that would be reported."""
    sums, gram = search.sums, search.gram
    error = float(np.sqrt(sums.covariance(base, column)[0, 0]))
    chance = search.significance.below(effect)
    sure = error * float(t_distribution.ppf(1.0 - chance / 2.0, max(1, sums.blocks - 1)))
    share = search.thresholds.material_share
    return max(sure, _material(gram, base, sums.weights(base), column, share))


def _material(
    gram: BlockGram,
    base: Index,
    weights: Array,
    columns: Index,
    share: float,
) -> float:
    """Return the smallest weight that explains a given share of the squares of one residual."""
    full, least = np.zeros(gram.width), np.inf
    full[base] = weights
    for place in gram.places:
        at = place.at(columns)
        if not len(at):
            continue
        beside = place.at(base)
        cross = place.whole[np.ix_(beside, at)]
        inverse = np.linalg.pinv(place.whole[np.ix_(beside, beside)], hermitian=True)
        own = float(place.whole[at[0], at[0]] - (cross.T @ inverse @ cross)[0, 0])
        if own > 0.0:
            ratio = share / (1.0 - share)
            least = min(least, float(np.sqrt(ratio * max(place.left(full), 0.0) / own)))
    return least


def _limit(candidate: Candidate, parameter: EffectParameter, least: float) -> Limit:
    absent = parameter.absent or 0.0
    low, high = candidate.effect.signature.negligible.get(parameter.name, (0.0, 0.0))
    least += min(-low, high)
    possible = bool(absent + least <= parameter.maximum or absent - least >= parameter.minimum)
    return Limit(
        candidate.effect_id, candidate.element, parameter.name, least, parameter.unit, possible
    )
