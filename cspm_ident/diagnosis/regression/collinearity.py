"""Whether columns explain anything, or the same, and how far that is from the truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, behind, paired
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def overlap(sums: BlockRegression, base: Index, own: Index, other: Index) -> bool:
    """Return whether columns explain the same, rather than as much of something else."""
    parts = (own, other, np.union1d(own, other))
    without = sums.squares_of(base)
    gains = [without - sums.squares_of(np.concatenate([base, part])) for part in parts]
    return gains[0] + gains[1] - gains[2] >= sums.thresholds.rival_gain_share * gains[0]


def contains(sums: BlockRegression, base: Index, wide: Index, narrow: Index) -> bool:
    """Return whether `narrow` is a case of `wide`, as Coulomb's friction of Stribeck's."""
    return bool(np.all(sums.spanned(base, wide, narrow) > sums.thresholds.nested_share))


def distance(
    worse: Array, undecided: float, wider: int, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> float:
    """Return by how many standard deviations of a normal something explains less.

    Args:
        worse: by how many squares, of each block, (blocks,).
        undecided: what decides nothing, models being as untrue as they are.
        wider: how many numbers it has more; each counts as in Schwarz's criterion, but for no more
            in a long recording than in a short one.
        thresholds: `tie_sigma` and `schwarz_most_pairs`.
    """
    worse = paired(worse)
    apart = max(0.0, behind(worse))
    if worse.sum() < undecided:
        apart = min(apart, thresholds.tie_sigma) * max(0.0, worse.sum() / undecided)
    return float(
        np.hypot(apart, np.sqrt(wider * np.log(min(len(worse), thresholds.schwarz_most_pairs))))
    )


def chance(sums: BlockRegression, base: Index, parts: Sequence[Index]) -> float:
    """Return how probable weights as large are by chance: of all parts together, or of the surest.

    Where few blocks tell much, many parts leave no test of all together.
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
    """Return by how many squares columns are seen to be untrue, at least none.

    The most of `freely_gained_at`.
    """
    return max(freely_gained_at(gram, sums, base, own).values(), default=0.0)


def freely_gained_at(
    gram: BlockGram, sums: BlockRegression, base: Index, own: Index
) -> dict[Place, float]:
    """Return by how many squares columns are seen to be untrue in each residual they act on.

    The most that a free function of a measured signal gains beyond them there, at least none;
    functions of time are left out, which gain what no other block tells.
    """
    both = np.concatenate([base, own])
    left = sums.held_out(both).sum()
    found = dict.fromkeys(gram.places_of(own), 0.0)
    for driver in gram.terms:
        if isinstance(driver, Driver) and driver.place in found and not driver.of_time:
            free = sums.held_out(np.append(both, gram.columns_of([driver]))).sum()
            found[driver.place] = max(found[driver.place], float(left - free))
    return found


def where_alike(members: Sequence[Candidate], elements: set[str]) -> list[tuple[Candidate, ...]]:
    """Return on which members an effect may do what something on some elements does."""
    same = tuple(c for c in members if c.element in elements)
    return [same] if same else list(dict.fromkeys([*((c,) for c in members), tuple(members)]))
