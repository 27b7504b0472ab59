"""The power that a model leaves open: residuals on held-out data times the rates they act at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_sim.effects import Channel

Array = NDArray[np.float64]

# Of each residual the rate that it acts at, and its sign where the machine loses energy: a shaft
# wants a torque and a cable gives a tension with the rate, drag pushes the bar against it.
_RATES = {
    Channel.SHAFT: ("speed [rad/s]", 1.0),
    Channel.TENSION: ("rate of elongation [m/s]", 1.0),
    Channel.WRENCH: ("speed [", -1.0),
}
# Of time, whose means are as good as independent.
_BATCHES = 24


class Power(NamedTuple):
    """Mean power that a part of the machine loses beyond what a model says, on held-out data.

    Attributes:
        place: of which residual.
        before: by the file's model [W]; below 0 the machine is given energy.
        after: with what was found [W].
        half: half the width of the 95 % interval of `after`, from the scatter of batches in time;
            infinite where there are fewer than two rows.
    """

    place: Place
    before: float
    after: float
    half: float

    @property
    def gives(self) -> bool:
        """Whether what is left surely gives energy, as no friction, drag or damper does."""
        return self.after + self.half < 0.0


def lost_powers(curves: Sequence[Curve]) -> tuple[Power, ...]:
    """Return the power of every residual that acts at a measured rate, in the order of places.

    Residual torques by motor speeds, tensions by rates of elongation, the bar's six components
    by its speeds. What stays open between drives' commands and reports is no energy of the machine.
    """
    groups: dict[Place, list[Curve]] = {}
    for curve in curves:
        groups.setdefault(curve.place, []).append(curve)
    found = []
    for place, members in groups.items():
        sides = [_rows(members, side) for side in ("before", "after")]
        if all(len(rows) for rows in sides):
            before, after = (float(rows.mean()) for rows in sides)
            found.append(Power(place, before, after, _half_width(sides[1])))
    return tuple(found)


def _rows(curves: Sequence[Curve], side: str) -> Array:
    """Return a place's power row by row [W]; components of one stretch add up."""
    stretches: dict[int, Array] = {}
    for curve in curves:
        rate, sign = _rate(curve)
        if rate is not None:
            own = sign * np.asarray(getattr(curve, side)) * rate
            # Components of one stretch have their times in common.
            key = id(curve.times)
            stretches[key] = stretches.get(key, np.zeros(len(own))) + own
    return np.concatenate([np.zeros(0), *stretches.values()])


def _rate(curve: Curve) -> tuple[Array | None, float]:
    """Return the rate at which a residual acts, with the sign of a loss; None if not measured."""
    name, sign = _RATES.get(curve.place.channel, ("", 0.0))
    rates = (values for key, values in curve.signals.items() if name and name in key)
    return next(rates, None), sign


def _half_width(rows: Array) -> float:
    """Return half the width of the 95 % interval of the mean of rows that hang together in time."""
    means = [part.mean() for part in np.array_split(rows, min(_BATCHES, len(rows)))]
    if len(means) < 2:
        return np.inf
    error = float(np.std(means, ddof=1)) / np.sqrt(len(means))
    return float(student.ppf(0.975, len(means) - 1) * error)
