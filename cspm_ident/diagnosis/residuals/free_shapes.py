"""Free functions of measured signals, for residuals that no effect of the catalogue explains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place

Array = NDArray[np.float64]

# Number of knots of a piecewise linear free function.
KNOTS = 7


class Driver(NamedTuple):
    """A free function of one measured signal, in one residual.

    Attributes:
        place: the residual.
        signal: name and unit of the function's argument.
    """

    place: Place
    signal: str

    @property
    def of_time(self) -> bool:
        """Whether it is a function of time, of which no two blocks share a part."""
        return self.signal.startswith("time")


class Knots:
    """Knots of each driver's free function, the same in all recordings."""

    def __init__(self) -> None:
        """Start without knots."""
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
        """Return hat functions of each signal; their weights are the function's knot values.

        Knots are at equal quantiles of the samples of the first recording with the signal. Signals
        that are constant there are left out.

        Args:
            place: the residual.
            signals: by name and unit, each of shape (k,).
            channel: of the residual that they act on.
            channels: number of the residual's channels.

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
    """Return the mean of the values `apart` rows before and after each row, (k,)."""
    padded = np.pad(values, apart, mode="edge")
    return 0.5 * (padded[: len(values)] + padded[2 * apart :])
