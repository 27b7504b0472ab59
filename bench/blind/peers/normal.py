"""Normal equations of a library: what regressions without look at the rows need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.blind.peers.library import Library
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_RANK = 1e-9


class Normal(NamedTuple):
    """Products of columns of length 1, what is never reported projected out.

    Attributes:
        gram: XᵀX, shape (m, m).
        cross: Xᵀy, shape (m,).
        square: yᵀy.
        rows: of X.
    """

    gram: Array
    cross: Array
    square: float
    rows: int

    def left(self, weights: Array) -> Array:
        """Return Σ residual² of weights (m, k), shape (k,)."""
        fitted = np.einsum("ik,ij,jk->k", weights, self.gram, weights)
        return np.asarray(self.square - 2.0 * self.cross @ weights + fitted)

    def bic(self, weights: Array) -> Array:
        """Return Schwarz's criterion of weights (m, k) for white residuals, shape (k,)."""
        left = np.maximum(self.left(weights), 1e-300)
        used = np.count_nonzero(weights, axis=0)
        return np.asarray(self.rows * np.log(left / self.rows) + used * np.log(self.rows))

    def root(self) -> tuple[Array, Array]:
        """Return X and y of so few rows as can be, (r, m) and (r,), with these products."""
        values, vectors = np.linalg.eigh(self.gram)
        kept = values > _RANK * values[-1]
        size = np.sqrt(values[kept])
        turned = vectors[:, kept].T
        return size[:, None] * turned, turned @ self.cross / size


def normal_of(
    library: Library, candidates: Sequence[Candidate], blocks: slice = slice(None)
) -> Normal:
    """Return the normal equations of candidates' columns, in the order of `columns_of`.

    Args:
        library: residuals and columns.
        candidates: whose columns are wanted.
        blocks: of the searched part.
    """
    gram = library.gram
    columns = gram.columns_of(candidates)
    whole, rows = _products(gram, blocks)
    both = np.append(columns, -1)
    own, never = whole[np.ix_(both, both)], gram.nuisance
    across = whole[np.ix_(both, never)]
    inverse = np.linalg.pinv(whole[np.ix_(never, never)], rcond=_RANK, hermitian=True)
    own = own - across @ inverse @ across.T
    # Every call scales alike, whatever its blocks.
    length = np.append(np.sqrt(np.diag(_products(gram, slice(None))[0])[columns]), 1.0)
    own = own / (length[:, None] * length)
    return Normal(own[:-1, :-1], own[:-1, -1], float(own[-1, -1]), rows)


def _products(gram: BlockGram, blocks: slice) -> tuple[Array, int]:
    whole, rows = np.zeros((gram.width + 1, gram.width + 1)), 0
    for place in gram.places:
        own = np.append(place.columns, gram.width)
        whole[np.ix_(own, own)] += place.grams[blocks].sum(axis=0)
        rows += int(place.rows[blocks].sum())
    return whole, rows
