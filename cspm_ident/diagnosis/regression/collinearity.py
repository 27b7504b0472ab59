"""Tests of regressors: collinearity, nesting, significance and model-form error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_comparison import behind, paired
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
NESTED_SHARE = 0.999
"""Of the squares: identity but for rounding and the single precision of columns."""
Index = NDArray[np.intp]


def overlap(sums: BlockRegression, base: Index, own: Index, other: Index) -> bool:
    """Return whether two sets of regressors explain the same part of the residual.

    This is not the case if they explain an equal amount of different parts.

    Args:
        sums: regression with all regressors.
        base: indices of regressors fitted with both.
        own: indices of the first set.
        other: indices of the second set.
    """
    parts = (own, other, np.union1d(own, other))
    without = sums.squares_of(base)
    gains = [without - sums.squares_of(np.concatenate([base, part])) for part in parts]
    return gains[0] + gains[1] - gains[2] >= sums.thresholds.majority_share * gains[0]


def contains(sums: BlockRegression, base: Index, wide: Index, narrow: Index) -> bool:
    """Return whether `narrow` is a case of `wide`, as Coulomb friction is of Stribeck friction."""
    return bool(np.all(sums.spanned(base, wide, narrow) > NESTED_SHARE))


def distance(
    worse: Array, undecided: float, wider: float, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> float:
    """Return by how many standard deviations of a normal something explains less.

    Args:
        worse: additional Σ residual² of each block, (blocks,).
        undecided: total below which the model-form error leaves the comparison undecided.
        wider: additional parameters. Each counts as in Schwarz's criterion, by pairs of
            blocks, of one recording at most: in more data model-form error decides, not noise.
        thresholds: `tie_sigma` and `block_count`.
    """
    worse = paired(worse)
    apart = max(0.0, behind(worse))
    if worse.sum() < undecided:
        share = worse.sum() / undecided if worse.sum() > 0.0 else 0.0
        apart = min(apart, thresholds.tie_sigma) * share
    pairs = min(len(worse), thresholds.block_count // 2)
    return float(np.hypot(apart, np.sqrt(wider * np.log(pairs))))


def chance(sums: BlockRegression, base: Index, parts: Sequence[Index]) -> float:
    """Return the p-value of all parts together, or of the most significant one.

    Where few blocks hold most of the information, many parts leave too few degrees of freedom for a
    joint test. The smaller of both p-values is corrected for the number of tests (Bonferroni).

    Args:
        sums: regression with all regressors.
        base: indices of regressors fitted beside the parts.
        parts: indices of each part.
    """
    together = sums.p_value(base, np.concatenate(parts))
    if len(parts) == 1:
        return together
    surest = 1.0
    for k, own in enumerate(parts):
        beside = np.concatenate([base, *parts[:k], *parts[k + 1 :]])
        surest = min(surest, sums.p_value(beside, own))
    return min(1.0, 2.0 * min(together, len(parts) * surest))


def freely_gained(gram: BlockGram, sums: BlockRegression, base: Index, own: Index) -> float:
    """Return the largest model-form error of regressors, in squares; at least 0.

    The maximum of `freely_gained_at` over all residuals.
    """
    return max(freely_gained_at(gram, sums, base, own).values(), default=0.0)


def freely_gained_at(
    gram: BlockGram, sums: BlockRegression, base: Index, own: Index
) -> dict[Place, float]:
    """Return the model-form error of regressors in each residual they act on, in squares.

    It is the largest hold-out gain of a free function of a measured signal beyond them, at least 0.
    Functions of time are excluded, because hold-out blocks have no information on them.
    """
    both = np.concatenate([base, own])
    left = sums.held_out(both).sum()
    found = dict.fromkeys(gram.places_of(own), 0.0)
    for driver in gram.terms:
        if isinstance(driver, Driver) and driver.place in found and not driver.of_time:
            free = sums.held_out(np.append(both, gram.columns_of([driver]))).sum()
            found[driver.place] = max(found[driver.place], float(left - free))
    return found


def places_for(members: Sequence[Candidate], elements: set[str]) -> list[tuple[Candidate, ...]]:
    """Return the members on which an effect may replace one on the given elements.

    These are the members on those elements. Where there are none: each member alone, then all.
    """
    same = tuple(c for c in members if c.element in elements)
    return [same] if same else list(dict.fromkeys([*((c,) for c in members), tuple(members)]))
