"""Least squares from block Gram matrices: errors under coloured residuals, cross-validation."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram, silenced, squares_by_block
from cspm_ident.diagnosis.regression.jackknife import RANK, Jackknife, left_out, pseudo_inverse
from cspm_ident.diagnosis.regression.long_run import LongRun, long_run
from cspm_ident.diagnosis.regression.symmetric_table import SymmetricTable
from cspm_ident.diagnosis.regression.usual_precision import usual_precision
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]
_Kind = TypeVar("_Kind", bound="BlockRegression")

# Number of folds of the cross-validation.
FOLDS = 6


class Gain(NamedTuple):
    """Reduction of the hold-out Σ residual² by some regressors.

    Attributes:
        total: over all blocks.
        error: its standard error, from the scatter between blocks.
    """

    total: float
    error: float


class BlockRegression:
    """Least squares from block Gram matrices, scaled so that each regressor has length 1.

    It never changes: `delayed` returns another one that shares the matrices.
    """

    def __init__(self, gram: BlockGram, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> None:
        """Take the Gram matrices of all residuals, and sum them."""
        self.thresholds = thresholds
        width = gram.width
        squares, self._at = np.zeros((gram.blocks, width + 1)), []
        for place in gram.places:
            own = np.append(place.columns, width)
            squares[:, own] += np.einsum("bii->bi", place.grams)
            at = np.full(width + 1, -1, dtype=np.intp)
            at[own] = np.arange(len(own))
            self._at.append(at)
        lengths = np.sqrt(squares.sum(axis=0))
        lengths[lengths == 0.0] = 1.0
        lengths[-1] = 1.0
        # Scaled on access, so that only one copy is held in memory.
        self._grams = [place.grams for place in gram.places]
        self._scales = [lengths[at >= 0] for at in self._at]
        self._lengths = lengths[:-1]
        self._prior = np.append(usual_precision(gram) / self._lengths**2, 0.0)
        self._starts: Index = np.zeros(width + 1, dtype=np.intp)
        self._undelayed: BlockRegression | None = None
        self._folds = np.array_split(np.arange(gram.blocks), min(FOLDS, gram.blocks))
        self._held_out: dict[bytes, Array] = {}

    def _of(self, rows: Index, columns: Index) -> Array:
        """Return each block's products of two sets of columns, (blocks, rows, columns)."""
        found = np.zeros((self.blocks, len(rows), len(columns)))
        for grams, at, scale in zip(self._grams, self._at, self._scales, strict=True):
            down, across = np.flatnonzero(at[rows] >= 0), np.flatnonzero(at[columns] >= 0)
            if len(down) and len(across):
                first, second = at[rows[down]], at[columns[across]]
                own = grams[:, first[:, None], second] / (scale[first][:, None] * scale[second])
                found[:, down[:, None], across] += own
        down, across = self._starts[rows], self._starts[columns]
        return silenced(found, down, across) if down.any() or across.any() else found

    def _summed(self, rows: Index) -> Array:
        """Return products of some columns with all over all blocks, (rows, width + 1)."""
        found = np.zeros((len(rows), len(self._at[0])))
        for grams, at, scale in zip(self._grams, self._at, self._scales, strict=True):
            down, across = np.flatnonzero(at[rows] >= 0), np.flatnonzero(at >= 0)
            if len(down):
                first = at[rows[down]]
                if self._starts.any():
                    starts = self._starts[rows[down]], self._starts[across]
                    own = silenced(grams[:, first], *starts).sum(axis=0)
                else:
                    own = grams.sum(axis=0)[first]
                found[down[:, None], across] += own / (scale[first][:, None] * scale)
        return found

    def _like(self: _Kind) -> _Kind:
        """Return a regression of the same kind, without Gram matrices."""
        other = object.__new__(type(self))
        other.thresholds, other._folds, other._held_out = self.thresholds, self._folds, {}
        return other

    def _alone(self, blocks: Array, lengths: Array) -> BlockRegression:
        """Return the sums of other products, (blocks, m + 1, m + 1), of columns so long."""
        other = self._like()
        other._grams, other._at = [blocks], [np.arange(blocks.shape[1])]
        other._scales = [np.ones(blocks.shape[1])]
        other._lengths, other._undelayed = lengths, None
        other._prior = np.zeros(blocks.shape[1])
        other._starts = np.zeros(blocks.shape[1], dtype=np.intp)
        return other

    def delayed(self, columns: Index, block: int) -> BlockRegression:
        """Return the same with some columns acting only from a block on."""
        if not block:
            return self
        other = self._like()
        other._grams, other._at, other._scales = self._grams, self._at, self._scales
        other._lengths, other._prior = self._lengths, self._prior
        other._starts = self._starts.copy()
        other._starts[columns] = np.maximum(self._starts[columns], block)
        other._undelayed = self if self._undelayed is None else self._undelayed
        return other

    def beside(self, combinations: Array) -> BlockRegression:
        """Return a regression with combinations of its columns appended, shape (width, k)."""
        return self._turned(np.arange(len(self._lengths)), combinations)

    def combined(
        self, base: Index, columns: Index, combinations: Array
    ) -> tuple[BlockRegression, Index, Index]:
        """Return a regression of a base and of combinations of other columns.

        Args:
            base: indices of unchanged columns.
            columns: indices of the columns to combine.
            combinations: their weights, (columns, k).

        Returns:
            The regression, and its indices of the base and of the combinations.
        """
        kept, first = np.concatenate([base, columns]), len(base)
        turn = np.vstack([np.zeros((first, combinations.shape[1])), combinations])
        own = len(kept) + np.arange(turn.shape[1])
        return self._turned(kept, turn), np.arange(first), own

    def _turned(self, columns: Index, combinations: Array) -> BlockRegression:
        """Return a regression of some columns, followed by their combinations, (columns, k)."""
        width, count = combinations.shape
        turn = np.zeros((width + 1, width + count + 1))
        turn[:width, :width], turn[-1, -1] = np.eye(width), 1.0
        turn[:width, width:-1] = combinations * self._lengths[columns, None]
        table = np.append(columns, len(self._starts) - 1)
        grams = turn.T @ self._of(table, table) @ turn
        # The squares of a combination equal to zero are rounding errors, which may be negative.
        lengths = np.append(np.sqrt(np.maximum(np.einsum("bii->i", grams), 0.0))[:-1], 1.0)
        lengths[lengths == 0.0] = 1.0
        grams = grams / (lengths[:, None] * lengths)
        found = self._alone(grams, lengths[:-1] * np.append(self._lengths[columns], np.ones(count)))
        found._prior = turn[:-1].T ** 2 @ self._prior[columns] / lengths**2
        return found

    @cached_property
    def _whole(self) -> SymmetricTable:
        """Sums of all blocks, (width + 1, width + 1)."""
        if self._undelayed is None:
            every = np.arange(len(self._starts))
            return SymmetricTable(self._expected(every, self._summed(every)))
        late = np.flatnonzero(self._starts)
        found = self._expected(late, self._summed(late))
        return self._undelayed._whole.replacing(late, found)

    def _expected(self, rows: Index, products: Array) -> Array:
        """Return rows of products, (rows, width + 1), with what is known of weights beforehand."""
        products[np.arange(len(rows)), rows] += self._prior[rows]
        return products

    def _near(self, fold: Index) -> slice:
        """Return the blocks of a fold and their neighbours."""
        return slice(max(0, int(fold[0]) - 1), int(fold[-1]) + 2)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self._grams[0])

    @property
    def lengths(self) -> Array:
        """Length of each column, (width,); 1 where it is zero."""
        return np.asarray(self._lengths)

    @property
    def squares(self) -> float:
        """Σ y²."""
        return float(self._whole.diagonal()[-1])

    @cached_property
    def excited(self) -> NDArray[np.bool_]:
        """Whether each column is non-zero anywhere, (width,)."""
        return np.asarray((self._whole.diagonal() - self._prior)[:-1] > 0.0)

    def freedom(self, columns: Index) -> float:
        """Return how many weights the data determine, rather than what is known of them before.

        The effective number of parameters of a ridge regression (Hastie, Tibshirani, Friedman, The
        Elements of Statistical Learning, 2nd ed., 2009, eq. 3.50).
        """
        inverse = pseudo_inverse(self._whole.at(columns, columns))
        return float(len(columns) - np.diag(inverse) @ self._prior[columns])

    def weights(self, columns: Index) -> Array:
        """Return the least-squares weights of columns."""
        return np.asarray(self._weights(columns) / self._lengths[columns])

    def weights_beyond(self, base: Index, columns: Index) -> Array:
        """Return the weights of columns fitted to a base's residual, the base's weights held."""
        both = self._whole.at(columns, base)
        left = self._whole.last(columns) - both @ self._weights(base)
        inverse = pseudo_inverse(self._whole.at(columns, columns))
        return np.asarray(inverse @ left / self._lengths[columns])

    def gains_beyond(self, base: Index, groups: list[Index]) -> Array:
        """Return by how much each group of columns lowers Σ residual² beyond a base, (groups,)."""
        inverse = pseudo_inverse(self._whole.at(base, base))
        explained = inverse @ self._whole.rows(base)
        found = np.zeros(len(groups))
        for k, group in enumerate(groups):
            left = self._whole.at(group, group) - (
                self._whole.at(group, base) @ explained[:, group]
            )
            cross = self._whole.last(group) - self._whole.at(group, base) @ explained[:, -1]
            # Columns that the base nearly spans leave rounding errors only.
            left[np.diag_indices(len(left))] += RANK
            found[k] = cross @ np.linalg.solve(left, cross)
        return found

    def held_out(self, columns: Index) -> Array:
        """Return the hold-out Σ residual² of each block, (blocks,).

        The fit uses the blocks outside its fold, except those next to the fold.
        """
        # One base serves hundreds of candidates.
        key = np.asarray(columns, dtype=np.intp).tobytes()
        if key not in self._held_out:
            self._held_out[key] = self._predicted(columns)
        return self._held_out[key]

    def _predicted(self, columns: Index) -> Array:
        both = np.append(columns, len(self._starts) - 1)
        parts, out = self._of(both, both), np.zeros(self.blocks)
        whole = self._whole.at(both, both)
        for fold in self._folds:
            others = whole - parts[self._near(fold)].sum(axis=0)
            weights = pseudo_inverse(others[:-1, :-1]) @ others[:-1, -1]
            out[fold] = squares_by_block(parts[fold], weights)
        return out

    def gain(self, base: Index, columns: Index) -> Gain:
        """Return the hold-out gain of columns beyond a base."""
        better = self.held_out(base) - self.held_out(np.concatenate([base, columns]))
        return gain_of(better)

    def gain_within(self, base: Index, columns: Index) -> Gain:
        """Return the gain of columns beyond a base in the blocks that they were fitted to.

        For columns that differ in every block, such as functions of time. Hold-out blocks have no
        information on them.
        """
        return gain_of(self._fitted(base) - self._fitted(np.concatenate([base, columns])))

    def _fitted(self, columns: Index) -> Array:
        """Return Σ residual² of each block, fitted to all of them."""
        both = np.append(columns, len(self._starts) - 1)
        return squares_by_block(self._of(both, both), self._weights(columns))

    def drift(self, base: Index, columns: Index) -> tuple[Gain, float]:
        """Return the gain, and its p-value, of letting weights change over the blocks.

        The change is proportional to the block's number. It is fitted beside a base and the
        columns.
        """
        first, count = len(base), len(columns)
        kept = np.concatenate([base, columns, [len(self._starts) - 1]])
        turn = np.zeros((self.blocks, len(kept) + count, len(kept)))
        turn[:, np.arange(first + count), np.arange(first + count)] = 1.0
        number = np.linspace(-0.5, 0.5, self.blocks)[:, None]
        turn[:, first + count + np.arange(count), first + np.arange(count)] = number
        turn[:, -1, -1] = 1.0
        blocks = turn @ self._of(kept, kept) @ turn.transpose(0, 2, 1)
        narrow = self._alone(blocks, np.ones(first + 2 * count))
        always, changing = np.arange(first + count), first + count + np.arange(count)
        return narrow.gain(always, changing), narrow.p_value(always, changing)

    def covariance(self, base: Index, columns: Index) -> Array:
        """Return the covariance of the weights of columns beside a base.

        By the block jackknife (Bell and McCaffrey, Surv. Methodol. 28(2), 2002), which is not too
        small for few blocks. The weights of the base are held.
        """
        scale = self._lengths[columns]
        covariance = left_out(self._beyond(base, columns)).covariance
        return np.asarray(covariance / np.outer(scale, scale))

    def half_width(self, base: Index, columns: Index) -> Array:
        """Return half the widths of 95 % intervals of the weights of columns beside a base.

        Infinite where a single block determines a weight, and 0 where nothing excites it, so that
        it has none.
        """
        return self.long_run(base, columns).half_widths

    def long_run(self, base: Index, columns: Index) -> LongRun:
        """Return these intervals with what they rest on; blocks may be correlated."""
        both = np.concatenate([base, columns, [len(self._starts) - 1]])
        found = long_run(self._of(both, both), len(columns))
        return found._replace(half_widths=found.half_widths / self._lengths[columns])

    def p_value(self, base: Index, columns: Index) -> float:
        """Return the p-value of the weights under the hypothesis that all are 0.

        By Wald's test with the block jackknife covariance. So a single block is never significant,
        while a few that agree may be. Blocks count by their information on the columns. A block
        with most of it is left out, and the others are tested; this is repeated.

        Args:
            base: columns beside them.
            columns: those tested.
        """
        return self._undominated(base, columns).chance()

    def _undominated(self, base: Index, columns: Index) -> Jackknife:
        """Return the jackknife over all blocks except dominant ones.

        Blocks are left out while the others have information. Without the first dominant block
        another may dominate, for example where a rope is first pulled taut.
        """
        heard = np.arange(self.blocks)
        found = left_out(self._beyond(base, columns))
        while (most := found.dominant(self.thresholds.majority_share)) is not None:
            heard = np.delete(heard, most)
            others = self._beyond(base, columns, heard)
            if np.trace(others.sum(axis=0)[:-1, :-1]) <= RANK:
                break
            found = left_out(others)
        return found

    def _beyond(self, base: Index, columns: Index, blocks: Index | None = None) -> Array:
        """Return blocks' products of columns and target, the part spanned by a base removed."""
        table = np.append(columns, len(self._starts) - 1)
        both = np.concatenate([base, table])
        products = self._of(both, both)
        if blocks is not None:
            products = products[blocks]
        whole, own = products.sum(axis=0), slice(len(base))
        spanned = pseudo_inverse(whole[own, own]) @ whole[own, len(base) :]
        turn = np.vstack([-spanned, np.eye(len(table))])
        return np.asarray(turn.T @ products @ turn)

    def squares_of(self, columns: Index) -> float:
        """Return Σ residual² after a fit of columns."""
        weights = self._weights(columns)
        return float(self.squares - self._whole.last(columns) @ weights)

    def spanned(self, base: Index, wide: Index, narrow: Index) -> Array:
        """Return the share of each narrow column, beyond a base, that wide columns span."""
        both = np.concatenate([base, wide])

        def left(by: Index) -> Array:
            inverse = pseudo_inverse(self._whole.at(by, by))
            cross = self._whole.at(by, narrow)
            spanned = np.einsum("ij,ik,kj->j", cross, inverse, cross)
            return np.asarray(self._whole.diagonal()[narrow] - spanned)

        return np.asarray(1.0 - left(both) / np.maximum(left(base), RANK))

    def projected(self, base: Index, columns: Index) -> tuple[Array, Array]:
        """Return weights of a base for columns, (base, m), and products of what is left, (m, m).

        All columns are scaled to length 1.
        """
        cross = self._whole.at(base, columns)
        turned = pseudo_inverse(self._whole.at(base, base)) @ cross
        return turned, np.asarray(self._whole.at(columns, columns) - cross.T @ turned)

    def left_from(self, base: Index, columns: Index) -> Array:
        """Return Σ residual² where `columns` act only from each block on, shape (blocks,)."""
        own, table = slice(len(base), -1), np.concatenate([base, columns, [len(self._starts) - 1]])
        blocks = self._of(columns, table)
        # Products of the columns with base, themselves and target, summed from each block on.
        met = blocks[::-1].cumsum(axis=0)[::-1]
        crossed, products, reported = met[:, :, : len(base)], met[:, :, own], met[:, :, -1]
        turned = crossed @ pseudo_inverse(self._whole.at(base, base))
        products = products - turned @ crossed.transpose(0, 2, 1)
        reported = reported - turned @ self._whole.last(base)
        weights = np.linalg.pinv(products, rcond=RANK, hermitian=True) @ reported[..., None]
        gained = np.einsum("bi,bi->b", reported, weights[..., 0])
        return np.asarray(self.squares_of(base) - gained)

    def _weights(self, columns: Index) -> Array:
        inverse = pseudo_inverse(self._whole.at(columns, columns))
        return np.asarray(inverse @ self._whole.last(columns))


def gain_of(better: Array) -> Gain:
    """Return total and standard error of gains by block."""
    spread = float(better.std(ddof=1)) if len(better) > 1 else float("inf")
    return Gain(float(better.sum()), spread * float(np.sqrt(len(better))))
