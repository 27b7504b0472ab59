"""Products of hypotheses' regressors side by side, by residual and block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram, PlaceGram, silenced
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.usual_precision import usual_precision

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Products of the nuisance, of hypotheses and of the target, by residual and block.

    Elements that share parameters have one set of regressors, their sum. Regressors are scaled to
    length 1, and the target comes last.

    Attributes:
        products: shape (places, blocks, k + 1, k + 1), or (1, blocks, …) summed over the places.
        prior: what is known of each weight beforehand, as a precision, shape (k,).
        lengths: of the regressors before scaling, shape (k,); 0 where one is zero.
        fixed: number of the first regressors that every model has: nuisance, then a base.
        nuisance: number of the first of these that are fitted to each stretch anew.
        slices: regressors of each hypothesis that a model may have or not.
    """

    products: Array
    prior: Array
    lengths: Array
    fixed: int
    nuisance: int
    slices: tuple[slice, ...]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.products.shape[1])


@dataclass(frozen=True, eq=False)
class _Columns:
    """Columns of the Gram matrices, (n,), from which block each acts, and what they add up to."""

    columns: Index
    starts: Index
    turn: Array


def side_by_side(
    gram: BlockGram,
    base: Sequence[Hypothesis],
    free: Sequence[Hypothesis],
    apart: bool = True,
) -> SideBySide:
    """Return the products of hypotheses that every model has and of those that it may have.

    Args:
        gram: Gram matrices of all residuals, their columns acting all the time.
        base: hypotheses that every model has, beside the nuisance.
        free: hypotheses that a model may have.
        apart: whether residuals are kept apart, which takes memory; else they are summed.
    """
    always = _Columns(gram.nuisance, np.zeros_like(gram.nuisance), np.eye(len(gram.nuisance)))
    parts = [always, *(_columns_of(gram, each) for each in (*base, *free))]
    widths = [part.turn.shape[1] for part in parts]
    ends = np.cumsum(widths, dtype=np.intp)
    both = _joined(parts)
    each = (_products(place, both) for place in gram.places)
    products = np.stack(list(each)) if apart else np.asarray(sum(each))[None]
    lengths = np.sqrt(np.einsum("pbii->i", products))
    scale = np.append(np.where(lengths[:-1] > 0.0, lengths[:-1], 1.0), 1.0)
    products /= scale[:, None] * scale
    prior = both.turn.T**2 @ usual_precision(gram)[both.columns] / scale[:-1] ** 2
    first = len(base) + 1
    slices = tuple(slice(ends[k - 1], ends[k]) for k in range(first, len(parts)))
    fixed, nuisance = int(ends[first - 1]), int(ends[0])
    return SideBySide(products, prior, lengths[:-1], fixed, nuisance, slices)


def _columns_of(gram: BlockGram, hypothesis: Hypothesis) -> _Columns:
    columns, elements = gram.columns_of(hypothesis.candidates), len(hypothesis.candidates)
    turn = np.eye(len(columns))
    if hypothesis.common:
        turn = np.tile(np.eye(len(columns) // elements), (elements, 1))
    return _Columns(columns, np.full(len(columns), hypothesis.onset, dtype=np.intp), turn)


def _joined(parts: Sequence[_Columns]) -> _Columns:
    rows, columns = (sum(part.turn.shape[axis] for part in parts) for axis in (0, 1))
    turn, down, across = np.zeros((rows, columns)), 0, 0
    for part in parts:
        high, wide = part.turn.shape
        turn[down : down + high, across : across + wide] = part.turn
        down, across = down + high, across + wide
    own = np.concatenate([part.columns for part in parts])
    return _Columns(own, np.concatenate([part.starts for part in parts]), turn)


def _products(place: PlaceGram, both: _Columns) -> Array:
    """Return one residual's products, (blocks, k + 1, k + 1)."""
    at = np.minimum(np.searchsorted(place.columns, both.columns), len(place.columns) - 1)
    there = np.flatnonzero(place.columns[at] == both.columns)
    inside = np.append(at[there], len(place.columns))
    own = place.every_gram[:, inside[:, None], inside]
    starts = np.append(both.starts[there], 0)
    if starts.any():
        own = silenced(own, starts, starts)
    turn = np.zeros((len(inside), both.turn.shape[1] + 1))
    turn[:-1, :-1], turn[-1, -1] = both.turn[there], 1.0
    used = np.flatnonzero(turn.any(axis=0))
    found = np.zeros((len(own), turn.shape[1], turn.shape[1]))
    found[:, used[:, None], used] = turn[:, used].T @ own @ turn[:, used]
    return found
