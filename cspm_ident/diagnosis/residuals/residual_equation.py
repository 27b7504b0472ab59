"""A residual beside everything that may explain it."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_model.robust_statistics import difference_noise

Array = NDArray[np.float64]
Term = Candidate | Driver
Rows = slice | NDArray[np.bool_]


class Made(Mapping[Term, Array]):
    """Columns that are made of others when they are asked for, so that all are held once only.

    In a long recording they are most of what there is.
    """

    def __init__(self, source: Mapping[Term, Array], make: Callable[[Array], Array]) -> None:
        """Take what they are made of, and how."""
        self._source, self._make = source, make

    def __getitem__(self, term: Term) -> Array:
        """Return a term's columns."""
        return self._make(self._source[term])

    def __contains__(self, term: object) -> bool:
        """Return whether a term has columns."""
        return term in self._source

    def __iter__(self) -> Iterator[Term]:
        """Yield the terms."""
        return iter(self._source)

    def __len__(self) -> int:
        """Return how many terms there are."""
        return len(self._source)


@dataclass(frozen=True, eq=False)
class Equation:
    """Measured less modelled, y = Σ columns·weights + what is left.

    Attributes:
        place: which residual.
        times: of the rows, ascending, shape (k,) [s].
        target: y, shape (k, channels).
        columns: by candidate or driver, what one unit of each weight adds, (k, channels, weights).
        measured: the measured quantity that the residual is part of, shape of `target`.
        nuisance: what no recording tells, such as the length wound at its start, (k, channels, m).
        shared: how many of the nuisance, the first, are the same in all stretches of a recording.
        turning: rows in which a shaft turns round, (k,), or none: it may stick there, and dry
            friction then holds with any torque.
        signals: measured signals that it may depend on, by name and unit, each of shape (k,).
    """

    place: Place
    times: Array
    target: Array
    columns: Mapping[Term, Array]
    measured: Array
    nuisance: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    turning: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    signals: Mapping[str, Array] = field(default_factory=dict)
    shared: int = 0

    @property
    def noise(self) -> Array:
        """What differs from row to row without connection, one sd per channel."""
        return difference_noise(self.target)

    def scaled(self, noise: Array) -> Equation:
        """Return the equation in units of a noise, (channels,)."""
        unit = np.where(noise > 0.0, noise, 1.0)
        columns = Made(self.columns, lambda found: found / unit[:, None])
        nuisance = self.nuisance / unit[:, None] if self.nuisance.size else self.nuisance
        return replace(
            self,
            target=self.target / unit,
            columns=columns,
            measured=self.measured / unit,
            nuisance=nuisance,
        )

    def within(self, start: float, end: float) -> Equation:
        """Return the rows from `start` to before `end` [s]."""
        first, last = np.searchsorted(self.times, [start, end])
        return self._only(slice(first, last))

    def apart_from(self, moments: Array, distance: float) -> Equation:
        """Return the rows that are farther than `distance` from all moments, shape (m,) [s]."""
        near: Array = np.abs(self.times[:, None] - moments)
        return self._only(np.asarray((near > distance).all(axis=1)))

    def weighted(self, weights: Array) -> Equation:
        """Return the equation with each row times a weight, shape (k,)."""
        rows = weights[:, None]
        columns = Made(self.columns, lambda found: found * rows[:, :, None])
        nuisance = self.nuisance * rows[:, :, None] if self.nuisance.size else self.nuisance
        return replace(self, target=self.target * rows, columns=columns, nuisance=nuisance)

    def only(self, terms: Container[Term]) -> Equation:
        """Return the equation without the columns of all other terms."""
        columns = {term: self.columns[term] for term in self.columns if term in terms}
        return replace(self, columns=columns)

    @property
    def compact(self) -> Equation:
        """The same with columns in single precision; what is summed of them is in double."""
        columns = {term: found.astype("f4") for term, found in self.columns.items()}
        return replace(self, columns=columns)

    @property
    def steady(self) -> Equation:
        """The rows in which no shaft turns round."""
        return self._only(~self.turning) if self.turning.any() else self

    def _only(self, rows: Rows) -> Equation:
        return Equation(
            self.place,
            self.times[rows],
            self.target[rows],
            Made(self.columns, lambda found: found[rows]),
            self.measured[rows],
            self.nuisance[rows] if self.nuisance.size else self.nuisance,
            self.turning[rows] if self.turning.size else self.turning,
            {name: found[rows] for name, found in self.signals.items()},
            self.shared,
        )


def steady(parts: Sequence[Sequence[Equation]]) -> list[list[Equation]]:
    """Return equations without the rows in which a shaft turns round."""
    return [[equation.steady for equation in part] for part in parts]


def in_noise(
    parts: Sequence[Sequence[Equation]], noise: Mapping[Place, Array]
) -> list[list[Equation]]:
    """Return equations in units of their noise, without those whose noise is not known."""
    return [[e.scaled(noise[e.place]) for e in part if e.place in noise] for part in parts]
