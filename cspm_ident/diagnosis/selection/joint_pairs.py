"""Pairs of effects on one element that mask each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate

Index = NDArray[np.intp]
Pair = tuple[Hypothesis, Hypothesis]


def best_pairs(
    gram: BlockGram, sums: BlockRegression, base: Index, free: Sequence[Candidate]
) -> list[Pair]:
    """Return the pairs of effects on one element that gain most beyond a base, the best first.

    Each effect has the shape of its largest gain alone. Stepwise selection misses pairs that mask
    each other in one residual, such as the zero offsets of load cell and drive at a shaft.

    Args:
        gram: Gram matrices of all columns.
        sums: the block regression of its columns.
        base: columns that are fitted beside.
        free: candidates that may be added.
    """
    alone = sums.gains_beyond(base, [gram.columns_of([c]) for c in free])
    best: dict[tuple[str, str], Candidate] = {}
    for k in np.argsort(-alone):
        best.setdefault((free[k].element, free[k].effect_id), free[k])
    own = sorted(best.values(), key=lambda candidate: candidate.element)
    pairs = [pair for pair in combinations(own, 2) if pair[0].element == pair[1].element]
    gains = sums.gains_beyond(base, [gram.columns_of(pair) for pair in pairs])
    most = sums.thresholds.screened_candidates
    return [
        (Hypothesis(one.effect, (one,)), Hypothesis(other.effect, (other,)))
        for one, other in (pairs[k] for k in np.argsort(-gains)[:most])
    ]
