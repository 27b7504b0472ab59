"""Weights of candidates with their intervals; several elements may share their weights."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]
Index = NDArray[np.intp]
# Probability on either side of a 95 % interval.
_OUTSIDE = 0.025
# By candidate: weights of its columns, and half the widths of their 95 % intervals.
Weights = dict[Candidate, tuple[Array, Array]]


def values_of(
    gram: BlockGram,
    sums: BlockRegression,
    candidates: Sequence[Candidate],
    common: Collection[str] = (),
) -> dict[Candidate, Array]:
    """Return the same weights as `weights_of`, without their intervals."""
    if not common:
        return gram.parted(candidates, sums.weights(gram.with_nuisance(candidates)))
    return {c: w for c, (w, _) in weights_of(gram, sums, candidates, common).items()}


def weights_of(
    gram: BlockGram,
    sums: BlockRegression,
    candidates: Sequence[Candidate],
    common: Collection[str] = (),
    base: Index | None = None,
) -> Weights:
    """Return candidates' weights with half the widths of their 95 % intervals.

    Args:
        gram: of their regressors.
        sums: regression of these.
        candidates: fitted together.
        common: ids of effects whose candidates all share their weights.
        base: columns that are fitted beside them; None: the nuisance.
    """
    beside = gram.nuisance if base is None else base
    causes, number = causes_of(gram, candidates, common)
    sums, beside, own = sums.combined(beside, gram.columns_of(candidates), causes)
    free = sums.weights(np.concatenate([beside, own]))[len(beside) :]
    values = gram.parted(candidates, free[number])
    widths = gram.parted(candidates, sums.half_width(beside, own)[number])
    return {c: (values[c], widths[c]) for c in candidates}


def at_once(weights: Weights) -> Weights:
    """Return weights with 95 % intervals for all candidates jointly (Bonferroni)."""
    if not weights:
        return weights
    wider = float(norm.isf(_OUTSIDE / len(weights)) / norm.isf(_OUTSIDE))
    return {c: (own, wider * half) for c, (own, half) in weights.items()}


def causes_of(
    gram: BlockGram, candidates: Sequence[Candidate], common: Collection[str]
) -> tuple[Array, Index]:
    """Return which columns share a free parameter, (columns, parameters), and each one's index.

    Args:
        gram: of the candidates' regressors.
        candidates: fitted together.
        common: ids of effects whose candidates all share their weights.
    """
    number = _numbers(gram, candidates, common)
    return np.eye(number.max(initial=-1) + 1)[number], number


def _numbers(gram: BlockGram, candidates: Sequence[Candidate], common: Collection[str]) -> Index:
    """Return the index of each column's free parameter in the fit."""
    numbers: dict[tuple[str, str, int], int] = {}
    found = []
    for candidate in candidates:
        element = "" if candidate.effect_id in common else candidate.element
        span = gram.slices[candidate]
        for k in range(span.stop - span.start):
            key = candidate.effect_id, element, k
            found.append(numbers.setdefault(key, len(numbers)))
    return np.array(found, dtype=np.intp)
