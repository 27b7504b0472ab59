"""Effects masked by a wrong parameter of the test-bed file; together they resemble a third."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram, PlaceGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate

Index = NDArray[np.intp]


def absorbed_pairs(
    gram: BlockGram,
    sums: BlockRegression,
    base: Index,
    hypothesis: Hypothesis,
    free: Sequence[Candidate],
) -> list[tuple[Hypothesis, Hypothesis]]:
    """Return pairs of an effect and a wrong parameter that explain the same as one hypothesis.

    The parameter alone explains the main residual but raises others, which the effect corrects.
    Example: a drum radius fitted with a wrong drive gain resembles an encoder scale error in every
    sensor.

    Args:
        gram: Gram matrices of all columns.
        sums: the block regression of its columns.
        base: columns that are fitted beside.
        hypothesis: the hypothesis that pairs may replace; it acts on one element.
        free: candidates that are not selected.

    Returns:
        Pairs (effect, wrong parameter) with their best shapes, where both are significant. Empty
        for a hypothesis on several elements.
    """
    if len(hypothesis.candidates) > 1:
        return []
    there = [c for c in free if c.element == hypothesis.elements[0]]
    others = [c for c in there if c.effect_id != hypothesis.effect.id]
    numbers = [c for c in others if c.effect.physics.alter is not None]
    effects = [c for c in others if c.effect.physics.alter is None]
    own = gram.columns_of(hypothesis.candidates)
    gained = float(sums.gains_beyond(base, [own])[0])
    shows = _most(gram, sums, base, own)
    most = (1.0 - sums.thresholds.whole_share) * _left(shows, base, own)
    beside = {n: np.concatenate([base, gram.columns_of([n])]) for n in numbers}
    hiding = [n for n in numbers if _left(shows, beside[n], own) <= most]
    pairs = list(product(effects, hiding))
    gains = sums.gains_beyond(base, [gram.columns_of(pair) for pair in pairs])
    best: dict[tuple[str, str], tuple[Candidate, Candidate]] = {}
    for k in np.argsort(-gains):
        if gains[k] >= sums.thresholds.whole_share * gained:
            effect, number = pairs[k]
            best.setdefault((effect.effect_id, number.effect_id), pairs[k])
    return [
        (Hypothesis(effect.effect, (effect,)), Hypothesis(number.effect, (number,)))
        for effect, number in best.values()
        if _needed(gram, sums, base, effect, number)
    ]


def _most(gram: BlockGram, sums: BlockRegression, base: Index, own: Index) -> PlaceGram:
    """Return the residual whose squares the columns reduce most."""
    both = np.concatenate([base, own])
    before = gram.left(base, sums.weights(base))
    after = gram.left(both, sums.weights(both))
    return max(gram.places, key=lambda each: before[each.place] - after[each.place])


def _left(place: PlaceGram, by: Index, own: Index) -> float:
    """Return the summed squares of unit columns in one residual that others do not span."""
    known = place.at(by)
    mine = place.at(own)
    lengths = np.sqrt(np.diag(place.whole))
    lengths[lengths == 0.0] = 1.0
    gram = place.whole / (lengths * lengths[:, None])
    cross = gram[np.ix_(known, mine)]
    inverse = np.linalg.pinv(gram[np.ix_(known, known)], rcond=1e-9, hermitian=True)
    spanned = cross.T @ inverse @ cross
    return float(np.trace(gram[np.ix_(mine, mine)] - spanned))


def _needed(
    gram: BlockGram, sums: BlockRegression, base: Index, one: Candidate, other: Candidate
) -> bool:
    """Return whether each of two candidates is significant beside the other."""
    first, second = gram.columns_of([one]), gram.columns_of([other])
    return all(
        sums.p_value(np.concatenate([base, beside]), own) < sums.thresholds.false_alarm_rate
        for beside, own in ((first, second), (second, first))
    )
