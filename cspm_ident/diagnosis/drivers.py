"""What a residual may depend on when nothing in the catalogue explains it: free shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, Place

Array = NDArray[np.float64]

KNOTS = 7


class Driver(NamedTuple):
    """A free function of one measured signal, in one residual.

    Attributes:
        place: the residual.
        signal: what it is a function of, with its unit.
    """

    place: Place
    signal: str


def driver_columns(
    place: Place, signals: Mapping[str, Array], channel: int = 0, channels: int = 1
) -> dict[Candidate | Driver, Array]:
    """Return hat functions of each signal, so that their weights are the shape at the knots.

    Knots lie at equal shares of the samples. Signals that stand still are left out.

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
        knots = np.unique(np.quantile(values, np.linspace(0.0, 1.0, KNOTS)))
        if len(knots) < KNOTS:
            continue
        hats = np.stack([np.interp(values, knots, unit) for unit in np.eye(KNOTS)], axis=1)
        columns = np.zeros((len(values), channels, KNOTS))
        columns[:, channel] = hats
        found[Driver(place, name)] = columns
    return found
