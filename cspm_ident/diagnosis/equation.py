"""A residual beside everything that may explain it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.drivers import Driver

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Equation:
    """Measured less modelled, y = Σ columns·weights + what is left.

    Attributes:
        place: which residual.
        times: of the rows, shape (k,) [s].
        target: y, shape (k, channels).
        columns: by candidate or driver, what one unit of each weight adds, (k, channels, weights).
        measured: the measured quantity that the residual is part of, shape of `target`.
        nuisance: what no recording tells, such as the length wound at its start, (k, channels, m).
        signals: measured signals that it may depend on, by name and unit, each of shape (k,).
    """

    place: Place
    times: Array
    target: Array
    columns: Mapping[Candidate | Driver, Array]
    measured: Array
    nuisance: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    signals: Mapping[str, Array] = field(default_factory=dict)

    @property
    def noise(self) -> Array:
        """What differs from row to row without connection, one sd per channel.

        By third differences, whose binomial coefficients squared sum to 20; 1.4826 times the median
        is robust to steps.
        """
        apart = np.abs(np.diff(self.target, 3, axis=0))
        return np.asarray(1.4826 * np.median(apart, axis=0) / np.sqrt(20.0))

    def scaled(self, noise: Array) -> Equation:
        """Return the equation in units of a noise, (channels,)."""
        unit = np.where(noise > 0.0, noise, 1.0)
        columns = {term: found / unit[:, None] for term, found in self.columns.items()}
        nuisance = self.nuisance / unit[:, None] if self.nuisance.size else self.nuisance
        target, measured = self.target / unit, self.measured / unit
        return replace(self, target=target, columns=columns, measured=measured, nuisance=nuisance)

    def within(self, start: float, end: float) -> Equation:
        """Return the rows from `start` to before `end` [s]."""
        rows = (self.times >= start) & (self.times < end)
        columns = {term: found[rows] for term, found in self.columns.items()}
        nuisance = self.nuisance[rows] if self.nuisance.size else self.nuisance
        target, measured = self.target[rows], self.measured[rows]
        signals = {name: found[rows] for name, found in self.signals.items()}
        return Equation(self.place, self.times[rows], target, columns, measured, nuisance, signals)


def in_noise(
    parts: Sequence[Sequence[Equation]], noise: Mapping[Place, Array]
) -> list[list[Equation]]:
    """Return equations in units of their noise, without those whose noise is not known."""
    return [[e.scaled(noise[e.place]) for e in part if e.place in noise] for part in parts]
