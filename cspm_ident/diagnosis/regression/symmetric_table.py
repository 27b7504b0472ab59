"""A symmetric table of which some rows and columns are others, without a copy of the rest."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def _none() -> Index:
    return np.zeros(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class SymmetricTable:
    """A symmetric table, not to be written to.

    Attributes:
        base: shape (n, n).
        replaced: which rows and columns are others than the base's, shape (k,).
        others: these rows, shape (k, n).
    """

    base: Array
    replaced: Index = field(default_factory=_none)
    others: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        """Return n."""
        return len(self.base)

    @cached_property
    def _place(self) -> Index:
        """Where in `others` each row is, −1 where it is the base's, shape (n,)."""
        place = np.full(len(self.base), -1, dtype=np.intp)
        place[self.replaced] = np.arange(len(self.replaced))
        return place

    def at(self, rows: Index, columns: Index) -> Array:
        """Return the table at some rows and columns, shape (rows, columns)."""
        found = self.base[np.ix_(rows, columns)]
        if len(self.replaced):
            down, across = self._place[rows], self._place[columns]
            found[down >= 0] = self.others[np.ix_(down[down >= 0], columns)]
            found[:, across >= 0] = self.others[np.ix_(across[across >= 0], rows)].T
        return np.asarray(found)

    def rows(self, rows: Index) -> Array:
        """Return whole rows, shape (rows, n)."""
        found = self.base[rows]
        if len(self.replaced):
            down = self._place[rows]
            found[:, self.replaced] = self.others[:, rows].T
            found[down >= 0] = self.others[down[down >= 0]]
        return np.asarray(found)

    def last(self, rows: Index) -> Array:
        """Return the last column at some rows, shape (rows,)."""
        return np.asarray(self.at(rows, np.array([len(self.base) - 1]))[:, 0])

    def diagonal(self) -> Array:
        """Return the diagonal, shape (n,)."""
        found = np.diag(self.base).copy()
        found[self.replaced] = self.others[np.arange(len(self.replaced)), self.replaced]
        return np.asarray(found)

    def replacing(self, replaced: Index, others: Array) -> SymmetricTable:
        """Return the base with other rows, (k, n), and the same columns."""
        return SymmetricTable(self.base, replaced, others)
