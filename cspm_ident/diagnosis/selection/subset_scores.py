"""Every subset of some hypotheses, scored by how well it predicts blocks that were not fitted.

A subset is fitted to all blocks but those of a fold and their neighbours, and predicts the fold's
(Geisser, J. Am. Stat. Assoc. 70(350), 1975). Gram matrices make a fit a few multiplications.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.jackknife import RANK, pseudo_inverse
from cspm_ident.diagnosis.selection.side_by_side import SideBySide

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Subset = tuple[int, ...]

# Number of folds of the cross-validation.
FOLDS = 6
# Subsets fitted at once, so that their matrices fit into the cache.
_AT_ONCE = 2048


class SubsetScores:
    """Fits and predictions of subsets of the free hypotheses of `SideBySide`."""

    def __init__(self, sides: SideBySide) -> None:
        """Eliminate the nuisance and the base of each fold."""
        self._sides = sides
        by_block = sides.products.sum(axis=0)
        self._whole = by_block.sum(axis=0)
        self._folds = np.array_split(np.arange(sides.blocks), min(FOLDS, sides.blocks))
        self.trained, self._predicting = [], []
        for fold in self._folds:
            near = slice(max(0, int(fold[0]) - 1), int(fold[-1]) + 2)
            schur, turn = self._eliminated(self._whole - by_block[near].sum(axis=0))
            self.trained.append(schur)
            self._predicting.append(self._refitted(by_block[fold].sum(axis=0), turn))
        self._schur, self._turn = self._eliminated(self._whole)

    @property
    def spans(self) -> Array:
        """Share of the last of each pair of hypotheses that the first spans, (free, free)."""
        slices = self.own
        found = np.zeros((len(slices), len(slices)))
        table = self._schur
        for i, wide in enumerate(slices):
            inverse = pseudo_inverse(table[wide, wide])
            for j, narrow in enumerate(slices):
                cross = table[wide, narrow]
                held = np.einsum("ij,ik,kj->j", cross, inverse, cross)
                own = np.diag(table)[narrow]
                found[i, j] = float(np.min(held / np.maximum(own, RANK)))
        return found

    @property
    def heard(self) -> NDArray[np.bool_]:
        """Whether the base leaves each free hypothesis something to explain, (free,)."""
        own = np.diag(self._schur)
        return np.array([bool(np.any(own[each] > RANK)) for each in self.own])

    def squares(self, subsets: Sequence[Subset]) -> Array:
        """Return Σ residual² as predicted by each subset, (subsets,)."""
        found = np.zeros(len(subsets))
        for fold, trained, turn in zip(self._folds, self.trained, self._predicting, strict=True):
            products = turn.T @ self._sides.products[:, fold].sum(axis=(0, 1)) @ turn
            for rows, weights in self._fitted(trained, subsets):
                found[rows] += np.einsum("si,si->s", weights @ products, weights)
        return found

    def squares_at(self, subsets: Sequence[Subset]) -> Array:
        """Return Σ residual² as predicted, by residual and block, (subsets, places, blocks)."""
        found = np.zeros((len(subsets), *self._sides.products.shape[:2]))
        for fold, trained, turn in zip(self._folds, self.trained, self._predicting, strict=True):
            vectors = np.zeros((len(subsets), len(trained)))
            for rows, weights in self._fitted(trained, subsets):
                vectors[rows] = weights
            vectors = vectors @ turn.T
            products = self._sides.products[:, fold]
            found[:, :, fold] = np.einsum("pbsi,si->spb", vectors @ products, vectors)
        return np.maximum(found, 0.0)

    def weights(self, subsets: Sequence[Subset]) -> list[list[Array]]:
        """Return the weights of each hypothesis of each subset, fitted to all blocks."""
        lengths = self._sides.lengths[self._sides.fixed :]
        scale = np.where(lengths > 0.0, lengths, 1.0)
        found: list[list[Array]] = [[] for _ in subsets]
        for rows, weights in self._fitted(self._schur, subsets):
            own = weights[:, :-1] / scale
            for row, values in zip(rows, own, strict=True):
                found[row] = [values[self.own[k]] for k in subsets[row]]
        return found

    @cached_property
    def own(self) -> list[slice]:
        """The regressors of each free hypothesis among all free ones."""
        fixed = self._sides.fixed
        return [slice(each.start - fixed, each.stop - fixed) for each in self._sides.slices]

    def _eliminated(self, table: Array) -> tuple[Array, Array]:
        """Return the products of free hypotheses beyond the fixed ones, and the fixed weights.

        The latter, (fixed, free + 1), are those of the free regressors' and the target's fits.
        """
        table, fixed = table.copy(), self._sides.fixed
        at = np.arange(len(table) - 1)
        table[at, at] += self._sides.prior
        spanned = pseudo_inverse(table[:fixed, :fixed]) @ table[:fixed, fixed:]
        return table[fixed:, fixed:] - table[fixed:, :fixed] @ spanned, spanned

    def _refitted(self, table: Array, spanned: Array) -> Array:
        """Return what turns (free weights, −1) into weights of all regressors in a fold.

        The base's weights are those of the other blocks. The nuisance, such as the length wound at
        a start, is fitted to the fold, where only it is known.
        """
        fixed, own = self._sides.fixed, self._sides.nuisance
        free = spanned.shape[1]
        turn = np.vstack([-spanned, np.eye(free)])
        turn[:own] = -pseudo_inverse(table[:own, :own]) @ table[:own, own:] @ turn[own:]
        assert turn.shape == (fixed + free, free)
        return turn

    def _fitted(self, table: Array, subsets: Sequence[Subset]) -> Iterator[tuple[Index, Array]]:
        """Yield rows of subsets with their weights, and −1 for the target, (rows, free + 1)."""
        for count in sorted({len(each) for each in subsets}):
            alike = [k for k, each in enumerate(subsets) if len(each) == count]
            for first in range(0, len(alike), _AT_ONCE):
                rows = np.array(alike[first : first + _AT_ONCE], dtype=np.intp)
                yield rows, self._solved(table, [subsets[k] for k in rows])

    def _solved(self, table: Array, subsets: Sequence[Subset]) -> Array:
        own = self.own
        found = np.zeros((len(subsets), len(table)))
        found[:, -1] = -1.0
        lists = [[i for k in each for i in range(own[k].start, own[k].stop)] for each in subsets]
        widest = max(map(len, lists), default=0)
        if not widest:
            return found
        at = np.array([[*each, *[0] * (widest - len(each))] for each in lists], dtype=np.intp)
        there = np.arange(widest) < np.array(list(map(len, lists)))[:, None]
        both = there[:, :, None] & there[:, None, :]
        grams = np.where(both, table[at[:, :, None], at[:, None, :]], 0.0)
        diagonal = np.arange(widest)
        grams[:, diagonal, diagonal] += np.where(there, RANK, 1.0)
        reported = np.where(there, table[at, -1], 0.0)
        solved = np.linalg.solve(grams, reported[:, :, None])[:, :, 0]
        rows = np.broadcast_to(np.arange(len(subsets))[:, None], at.shape)
        found[rows[there], at[there]] = solved[there]
        return found


def subsets_of(count: int, most: int, spans: Array, nested: float) -> list[Subset]:
    """Return all subsets of up to `most` of some hypotheses, the empty one first.

    Left out are those in which one hypothesis contains another, which says nothing more.

    Args:
        count: number of hypotheses.
        most: largest number in a subset.
        spans: share of the second of each pair that the first spans, (count, count).
        nested: share from which on one contains the other.
    """
    apart = (spans < nested) & (nested > spans.T)
    return [
        subset
        for size in range(most + 1)
        for subset in combinations(range(count), size)
        if all(apart[i, j] for i, j in combinations(subset, 2))
    ]
