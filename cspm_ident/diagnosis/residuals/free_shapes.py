"""What a residual may depend on when nothing in the catalogue explains it: free shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place

Array = NDArray[np.float64]

# Of a free function of one signal, piecewise linear.
KNOTS = 7


class Driver(NamedTuple):
    """A free function of one measured signal, in one residual.

    Attributes:
        place: the residual.
        signal: what it is a function of, with its unit.
    """

    place: Place
    signal: str

    @property
    def of_time(self) -> bool:
        """Whether it is a function of time, which no two blocks have in common."""
        return self.signal.startswith("time")


class Knots:
    """Where each driver's free function has its values, alike in all recordings."""

    def __init__(self) -> None:
        """Know of none yet."""
        self._found: dict[Driver, Array] = {}

    def of(self, driver: Driver) -> Array:
        """Return a driver's knots in its signal's unit, shape (KNOTS,)."""
        return self._found[driver]

    def columns(
        self,
        place: Place,
        signals: Mapping[str, Array],
        channel: int = 0,
        channels: int = 1,
    ) -> dict[Candidate | Driver, Array]:
        """Return hat functions of each signal; their weights are the shape at the knots.

        Knots lie at equal shares of the samples of the first recording that has the signal.
        Signals that stand still there are left out.

        Args:
            place: the residual.
            signals: by name and unit, each of shape (k,).
            channel: in which of the residual's channels they act.
            channels: how many it has.

        Returns:
            Columns of shape (k, channels, KNOTS).
        """
        found: dict[Candidate | Driver, Array] = {}
        for name, values in signals.items():
            driver = Driver(place, name)
            if driver not in self._found:
                quantiles = np.quantile(values, np.linspace(0.0, 1.0, KNOTS))
                self._found[driver] = np.unique(quantiles)
            knots = self._found[driver]
            if len(knots) < KNOTS:
                continue
            hats = np.stack([np.interp(values, knots, unit) for unit in np.eye(KNOTS)], axis=1)
            columns = np.zeros((len(values), channels, KNOTS))
            columns[:, channel] = hats
            found[driver] = columns
        return found


def around(values: Array, apart: int) -> Array:
    """Return the mean of what is measured `apart` rows before and after each row, (k,)."""
    padded = np.pad(values, apart, mode="edge")
    return 0.5 * (padded[: len(values)] + padded[2 * apart :])
