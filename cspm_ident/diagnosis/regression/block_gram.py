"""Block Gram matrices: products of residuals and regressors, summed over blocks of time.

Every least-squares fit follows from them, with its errors under coloured residuals and its
cross-validation. So hundreds of hypotheses are tested with a single pass over the signals.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class PlaceGram(NamedTuple):
    """One residual's block Gram matrices.

    Attributes:
        place: which residual.
        columns: indices of its regressors, ascending, shape (m,).
        grams: Σ [columns, y]ᵀ[columns, y] per block, shape (blocks, m + 1, m + 1).
        whole: their sum over the blocks.
        rows: samples times channels per block, shape (blocks,).
    """

    place: Place
    columns: Index
    grams: Array
    whole: Array
    rows: Array


@dataclass(frozen=True, eq=False)
class BlockGram:
    """All residuals of one or several recordings.

    Attributes:
        slices: the columns of each candidate and driver.
        width: number of columns.
        nuisance: indices of the columns that are always fitted.
        places: the residuals.
        times: of the blocks' beginnings [s], shape (blocks,).
    """

    slices: dict[Candidate | Driver, slice]
    width: int
    nuisance: Index
    places: tuple[PlaceGram, ...]
    times: Array

    @property
    def terms(self) -> tuple[Candidate | Driver, ...]:
        """All candidates and drivers with columns."""
        return tuple(self.slices)

    def columns_of(self, terms: Iterable[Candidate | Driver]) -> Index:
        """Return the indices of some terms' columns, one term after the other."""
        spans = [self.slices[term] for term in terms]
        own = [np.arange(span.start, span.stop) for span in spans]
        return np.concatenate([np.zeros(0, dtype=np.intp), *own])

    def with_nuisance(self, terms: Iterable[Candidate | Driver]) -> Index:
        """Return the indices of the nuisance's columns, then those of some terms."""
        return np.concatenate([self.nuisance, self.columns_of(terms)])

    def parted(self, terms: Sequence[Candidate], values: Array) -> dict[Candidate, Array]:
        """Return values in the order of `columns_of`, split by term, without preceding values."""
        widths = [self.slices[term].stop - self.slices[term].start for term in terms]
        own = values[len(values) - sum(widths) :]
        parts = np.split(own, np.cumsum(widths, dtype=np.intp))
        return dict(zip(terms, parts[:-1], strict=True))

    def places_of(self, columns: Index) -> list[Place]:
        """Return the residuals that at least one of some columns acts on."""
        return [p.place for p in self.places if np.isin(columns, p.columns).any()]

    def left(self, columns: Index, weights: Array) -> dict[Place, float]:
        """Return Σ residual² of each place for some columns' weights."""
        found = {}
        full = np.zeros(self.width)
        full[columns] = weights
        for place in self.places:
            vector = np.append(full[place.columns], -1.0)
            found[place.place] = float(vector @ place.whole @ vector)
        return found

    def left_by_block(self, columns: Index, weights: Array) -> dict[Place, Array]:
        """Return Σ residual² of each place's blocks (blocks,) for some columns' weights."""
        full = np.zeros(self.width)
        full[columns] = weights
        return {
            place.place: squares_by_block(place.grams, full[place.columns]) for place in self.places
        }

    def left_with(
        self, weights: Mapping[Candidate, Array] | Mapping[Candidate | Driver, Array]
    ) -> dict[Place, float]:
        """Return Σ residual² of each place for given weights, its own nuisance fitted."""
        left = self.left_by_block_with(weights)
        return {place: float(squares.sum()) for place, squares in left.items()}

    def left_by_block_with(
        self, weights: Mapping[Candidate, Array] | Mapping[Candidate | Driver, Array]
    ) -> dict[Place, Array]:
        """Return Σ residual² of each place's blocks (blocks,) for given weights.

        The place's own nuisance is fitted to all of them.
        """
        found = {}
        full = np.zeros(self.width)
        for term, values in weights.items():
            if term in self.slices:
                full[self.slices[term]] = values
        for place in self.places:
            own = full[place.columns]
            free = np.isin(place.columns, self.nuisance)
            if free.any():
                inside = np.append(free, False)
                gram = place.whole[np.ix_(inside, inside)]
                cross = place.whole[inside] @ np.append(own, -1.0)
                own[free] -= np.linalg.pinv(gram, hermitian=True) @ cross
            found[place.place] = squares_by_block(place.grams, own)
        return found

    def delay(self, columns: Index, block: int) -> None:
        """Let columns act only from a block on."""
        for place in self.places:
            own = np.flatnonzero(np.isin(place.columns, columns))
            silence(place.grams, own, block)
            place.whole[own] = place.grams[:, own].sum(axis=0)
            place.whole[:, own] = place.grams[:, :, own].sum(axis=0)

    @contextmanager
    def delayed(self, columns: Index, block: int) -> Iterator[None]:
        """Let columns act only from a block on, inside the context only."""
        kept = [
            (place, own, place.grams[:block, own, :].copy(), place.grams[:block, :, own].copy())
            for place in self.places
            if len(own := np.flatnonzero(np.isin(place.columns, columns)))
        ]
        self.delay(columns, block)
        try:
            yield
        finally:
            for place, own, rows, sides in kept:
                place.grams[:block, own, :] = rows
                place.grams[:block, :, own] = sides
            self.delay(columns, 0)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self.times)


def squares_by_block(grams: Array, weights: Array) -> Array:
    """Return Σ residual² of each block (blocks,) from products of columns and target.

    Args:
        grams: Σ [columns, y]ᵀ[columns, y] per block, shape (blocks, m + 1, m + 1).
        weights: of the columns, shape (m,).
    """
    vector = np.append(weights, -1.0)
    return np.asarray(np.einsum("i,bij,j->b", vector, grams, vector))


def silence(grams: Array, columns: Index, block: int) -> None:
    """Set columns to zero in the Gram matrices (blocks, m, m) of the blocks before `block`."""
    grams[:block, columns, :] = 0.0
    grams[:block, :, columns] = 0.0


def gather(recordings: Sequence[Sequence[Equation]], block_s: float) -> BlockGram:
    """Return the block Gram matrices of all equations, in blocks of about `block_s` seconds.

    Args:
        recordings: the equations of each.
        block_s: longer than the residuals' correlation time.
    """
    equations = [(r, e) for r, each in enumerate(recordings) for e in each]
    slices, width = _registry([e for _, e in equations])
    edges, recording = _blocks(equations, block_s)
    first = width
    nuisance: list[int] = []
    common: dict[tuple[int, Place], list[int]] = {}
    places: dict[Place, list[tuple[int, Equation, list[int]]]] = {}
    for r, equation in equations:
        known = common.get((r, equation.place), [])
        new = list(range(first, first + equation.nuisance.shape[2] - len(known)))
        first += len(new)
        nuisance += new
        own = known + new
        common[r, equation.place] = own[: equation.shared]
        places.setdefault(equation.place, []).append((r, equation, own))
    gathered = tuple(
        _of_place(place, parts, slices, edges, recording) for place, parts in places.items()
    )
    return BlockGram(slices, first, np.array(nuisance, dtype=np.intp), gathered, edges)


def _registry(equations: Sequence[Equation]) -> tuple[dict[Candidate | Driver, slice], int]:
    slices: dict[Candidate | Driver, slice] = {}
    width = 0
    for equation in equations:
        for candidate, columns in equation.columns.items():
            if candidate not in slices:
                slices[candidate] = slice(width, width + columns.shape[2])
                width += columns.shape[2]
    return slices, width


def _blocks(
    equations: Sequence[tuple[int, Equation]], block_s: float
) -> tuple[Array, NDArray[np.intp]]:
    times, recording = [], []
    for r in sorted({r for r, _ in equations}):
        ends = [(e.times[0], e.times[-1]) for k, e in equations if k == r and len(e.times)]
        start, end = min(a for a, _ in ends), max(b for _, b in ends)
        count = max(1, round((end - start) / block_s))
        times.append(start + (end - start) / count * np.arange(count))
        recording.append(np.full(count, r, dtype=np.intp))
    return np.concatenate(times), np.concatenate(recording)


def _of_place(
    place: Place,
    parts: Sequence[tuple[int, Equation, list[int]]],
    slices: dict[Candidate | Driver, slice],
    edges: Array,
    recording: NDArray[np.intp],
) -> PlaceGram:
    used: set[int] = set()
    for _, equation, own in parts:
        used.update(own)
        for term in equation.columns:
            used.update(range(slices[term].start, slices[term].stop))
    columns = np.array(sorted(used), dtype=np.intp)
    where = {int(index): k for k, index in enumerate(columns)}
    grams = np.zeros((len(edges), len(columns) + 1, len(columns) + 1))
    rows = np.zeros(len(edges))
    for r, equation, own in parts:
        table = _table(equation, own, slices, where)
        blocks = np.flatnonzero(recording == r)
        home = blocks[np.searchsorted(edges[blocks], equation.times, side="right") - 1]
        for block in np.unique(home):
            part = table[home == block].reshape(-1, table.shape[2])
            grams[block] += part.T @ part
            rows[block] += len(part)
    return PlaceGram(place, columns, grams, grams.sum(axis=0), rows)


def _table(
    equation: Equation,
    own: Sequence[int],
    slices: dict[Candidate | Driver, slice],
    where: dict[int, int],
) -> Array:
    """Return columns and y side by side, shape (rows, channels, m + 1)."""
    table = np.zeros((*equation.target.shape, len(where) + 1))
    table[:, :, -1] = equation.target
    for k, index in enumerate(own):
        table[:, :, where[index]] = equation.nuisance[:, :, k]
    for candidate, columns in equation.columns.items():
        first = where[slices[candidate].start]
        table[:, :, first : first + columns.shape[2]] = columns
    return table
