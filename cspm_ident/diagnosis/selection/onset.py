"""Onset of an effect: its block, and its time with a finer resolution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Onset
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Index = NDArray[np.intp]
# Length of the fine blocks that resolve an onset [s].
FINE_S = 0.1


def first_block(sums: BlockRegression, base: Index, own: Index) -> tuple[int, float]:
    """Return the first block in which columns act, and the sum of squared residuals for it.

    The block is 0 unless a later one gains more by the share `minor_share`.

    Args:
        sums: the block regression of all columns.
        base: columns that act all the time.
        own: columns that may have an onset.
    """
    left = sums.left_from(base, own)[:-2]
    best = int(np.argmin(left))
    gained = sums.squares_of(base) - left[0]
    if left[best] < left[0] - sums.thresholds.minor_share * max(gained, 0.0):
        return best, float(left[best])
    return 0, float(left[0])


def onset_of(
    equations: Sequence[Equation],
    own: Sequence[Candidate],
    others: Mapping[Candidate, float],
    low: float,
    high: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Onset:
    """Return the onset of an effect with its interval [s].

    The squared residual is computed for an onset at every fine block. The interval contains all
    times at which it exceeds its minimum by no more than its scatter allows.

    Args:
        equations: those of one recording, in units of their noise.
        own: the effect on its elements.
        others: all other fitted candidates, with their onsets [s].
        low: earliest possible time [s].
        high: latest possible time [s].
        thresholds: `certain_sigma`.
    """
    terms = [*own, *others]
    places = {term: [e for e in equations if term in e.columns] for term in own}
    concerned = {e.place for found in places.values() for e in found}
    rows = [e.only(terms) for e in equations if e.place in concerned]
    gram = gather([rows], FINE_S)
    sums, edges = BlockRegression(gram, thresholds), gram.times
    others = {term: time for term, time in others.items() if term in gram.slices}
    for term, time in others.items():
        sums = sums.delayed(gram.columns_of([term]), int(np.searchsorted(edges, time)))
    base, columns = gram.with_nuisance(others), gram.columns_of(own)
    first, last = np.searchsorted(edges, [low, high])
    blocks = np.arange(max(first, 1), max(min(last, len(edges) - 2), first + 2))
    left = sums.left_from(base, columns)[blocks]
    best = int(np.argmin(left))
    sums = sums.delayed(columns, int(blocks[best]))
    both = np.concatenate([base, columns])
    scatter = float(np.std(sums.held_out(both)))
    possible = edges[blocks[left <= left[best] + thresholds.certain_sigma * scatter]]
    step = edges[1] - edges[0]
    return Onset(float(edges[blocks[best]]), float(possible[0] - step), float(possible[-1] + step))
