"""Block Gram matrices: products of residuals and regressors, summed over blocks of time.

Every least-squares fit follows from them, with its errors under coloured residuals and its
cross-validation. So hundreds of hypotheses are tested with a single pass over the signals.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PlaceGram:
    """One residual's block Gram matrices, not to be written to.

    Attributes:
        place: which.
        columns: indices of the columns that enter, ascending, shape (m,).
        every_gram: Σ [columns, y]ᵀ[columns, y] per block, shape (blocks, m + 1, m + 1), columns
            acting all the time.
        whole: the sum of `grams` over the blocks, (m + 1, m + 1).
        rows: samples times channels per block, shape (blocks,).
        starts: from which block on each column and y act, shape (m + 1,); None: all the time.
    """

    place: Place
    columns: Index
    every_gram: Array
    whole: Array
    rows: Array
    starts: Index | None = None

    @cached_property
    def grams(self) -> Array:
        """Σ [columns, y]ᵀ[columns, y] per block, shape (blocks, m + 1, m + 1)."""
        if self.starts is None:
            return self.every_gram
        return silenced(self.every_gram.copy(), self.starts, self.starts)

    def at(self, columns: Index) -> Index:
        """Return where those of some columns that enter are in the matrices, ascending."""
        own = np.searchsorted(self.columns, columns)
        own, wanted = own[own < len(self.columns)], columns[own < len(self.columns)]
        return np.sort(own[self.columns[own] == wanted])

    def left(self, weights: Array) -> float:
        """Return Σ residual² for weights of all columns of all residuals, (width,)."""
        vector = np.append(weights[self.columns], -1.0)
        return float(vector @ self.whole @ vector)

    def delayed(self, columns: Index, block: int) -> PlaceGram:
        """Return the same with some columns acting only from a block on."""
        own = self.at(columns)
        if not len(own):
            return self
        starts = np.zeros(len(self.whole), dtype=np.intp) if self.starts is None else self.starts
        starts = starts.copy()
        starts[own] = np.maximum(starts[own], block)
        rows = silenced(self.every_gram[:, own], starts[own], starts).sum(axis=0)
        whole = self.whole.copy()
        whole[own], whole[:, own] = rows, rows.T
        return replace(self, whole=whole, starts=starts)


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
        return [place.place for place in self.places if len(place.at(columns))]

    def left(self, columns: Index, weights: Array) -> dict[Place, float]:
        """Return Σ residual² of each place for some columns' weights."""
        full = np.zeros(self.width)
        full[columns] = weights
        return {place.place: place.left(full) for place in self.places}

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

    def delayed(self, columns: Index, block: int) -> BlockGram:
        """Return the same with some columns acting only from a block on."""
        return replace(self, places=tuple(p.delayed(columns, block) for p in self.places))

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


def silenced(products: Array, rows: Index, columns: Index) -> Array:
    """Set products of columns to zero in the blocks before those from which on both act.

    Args:
        products: by block, shape (blocks, r, c); changed.
        rows: from which block on the rows' columns act, (r,).
        columns: likewise of the columns, (c,).

    Returns:
        The products.
    """
    blocks = np.arange(len(products))[:, None, None]
    products[blocks < np.maximum(rows[:, None], columns)] = 0.0
    return products


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
        if not len(home):
            continue
        # Rows are in order of time, so that a block's are next to each other.
        found, first = np.unique(home, return_index=True)
        for block, own_rows in zip(found, np.split(table, first[1:]), strict=True):
            part = own_rows.reshape(-1, table.shape[2])
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
