"""A residual and all regressors that may explain it."""

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

# Equations written side by side: each takes all signals of a recording for a moment.
AT_ONCE = 2


class Made(Mapping[Term, Array]):
    """Regressors computed from others on access, so that only one copy is held in memory.

    In a long recording they take most of the memory.
    """

    def __init__(self, source: Mapping[Term, Array], make: Callable[[Array], Array]) -> None:
        """Take the source and the function that computes regressors from it."""
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
    """A residual equation, measured less modelled: y = Σ columns·weights + remainder.

    Attributes:
        place: which residual.
        times: of the rows, ascending, shape (k,) [s].
        target: y, shape (k, channels).
        columns: by candidate or driver, regressors per unit of each weight, (k, channels, weights).
        measured: the measured quantity in the residual, shape of `target`.
        nuisance: regressors of unknown quantities, such as the length wound at the start, (k,
            channels, m).
        shared: number of nuisance regressors, the first ones, common to all stretches of a
            recording.
        turning: rows that no term describes, (k,), or empty: with a reversal of the shaft, which
            may stick there, held by dry friction with any torque; or with a snap of the cable.
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
        """White noise of the target from differences between rows, one sd per channel."""
        return difference_noise(self.target)

    @property
    def left(self) -> Array:
        """The target without its fitted nuisance terms, shape (k, channels)."""
        if not self.nuisance.size:
            return self.target
        columns = self.nuisance.reshape(self.target.size, -1)
        target = self.target.reshape(-1)
        left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
        return np.asarray(left.reshape(self.target.shape))

    def less(self, weights: Mapping[Candidate, Array]) -> Equation:
        """Return the equation with its terms of the given weights subtracted from the target."""
        target = self.target
        for term, own in weights.items():
            if term in self.columns:
                target = target - self.columns[term] @ own
        return replace(self, target=target)

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

    def without_snaps(self, errors: Array, most: float) -> Equation:
        """Return the equation with the rows marked whose error, (k,), exceeds the target's noise.

        Args:
            errors: of the equation's linearisation.
            most: share of the rows up to which they are marked: beyond it there is no other motion.
        """
        snapping = ~(np.abs(errors) <= self.noise[0])
        return replace(self, turning=snapping) if snapping.mean() <= most else self

    def weighted(self, weights: Array) -> Equation:
        """Return the equation with each row times a weight, shape (k,)."""
        rows = weights[:, None]
        columns = Made(self.columns, lambda found: found * rows[:, :, None])
        nuisance = self.nuisance * rows[:, :, None] if self.nuisance.size else self.nuisance
        return replace(self, target=self.target * rows, columns=columns, nuisance=nuisance)

    def only(self, terms: Container[Term]) -> Equation:
        """Return the equation without the regressors of all other terms."""
        columns = {term: self.columns[term] for term in self.columns if term in terms}
        return replace(self, columns=columns)

    @property
    def compact(self) -> Equation:
        """The equation with regressors in single precision; their sums are in double."""
        columns = {term: found.astype("f4", copy=False) for term, found in self.columns.items()}
        return replace(self, columns=columns)

    @property
    def steady(self) -> Equation:
        """The rows without a reversal of the shaft or a snap of the cable."""
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
    """Return equations without the rows in which a shaft reverses or a cable snaps."""
    return [[equation.steady for equation in part] for part in parts]


def in_noise(
    parts: Sequence[Sequence[Equation]], noise: Mapping[Place, Array]
) -> list[list[Equation]]:
    """Return equations in units of their noise, without those of unknown noise."""
    return [[e.scaled(noise[e.place]) for e in part if e.place in noise] for part in parts]
