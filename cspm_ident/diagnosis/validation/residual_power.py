"""Residual power: hold-out residuals times the measured rates at which they act."""

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

# Rate at which each residual acts, and the sign of a loss. Lost torque and tension act along the
# rate; drag acts on the bar against it.
_RATES = {
    Channel.SHAFT: ("speed [rad/s]", 1.0),
    Channel.TENSION: ("rate of elongation [m/s]", 1.0),
    Channel.WRENCH: ("speed [", -1.0),
}
# Number of batches in time, whose means are nearly independent.
_BATCHES = 24


class Power(NamedTuple):
    """Mean power that a part of the machine loses beyond the model's, on held-out data.

    Attributes:
        place: which residual.
        before: with the file's model [W]; below 0 the machine gains energy.
        after: with the findings [W].
        half: half width of the 95 % interval of `after` [W], from the scatter of batches in time;
            infinite where there are fewer than two rows.
    """

    place: Place
    before: float
    after: float
    half: float

    @property
    def gives(self) -> bool:
        """Whether the residual significantly supplies energy, which no dissipative law can."""
        return self.after + self.half < 0.0


def lost_powers(curves: Sequence[Curve]) -> tuple[Power, ...]:
    """Return the power of every residual that acts at a measured rate, in the order of places.

    Torques act at motor speeds, tensions at rates of elongation, and the bar's wrench at its six
    velocities. Drive residuals, between commanded and reported torque, are no power of the machine.
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
    """Return a place's power, shape (rows,) [W]; components of one stretch add up."""
    stretches: dict[int, Array] = {}
    for curve in curves:
        rate, sign = _rate(curve)
        if rate is not None:
            own = sign * np.asarray(getattr(curve, side)) * rate
            # Components of one stretch share one array of times.
            key = id(curve.times)
            stretches[key] = stretches.get(key, np.zeros(len(own))) + own
    return np.concatenate([np.zeros(0), *stretches.values()])


def _rate(curve: Curve) -> tuple[Array | None, float]:
    """Return the rate at which a residual acts, with the sign of a loss; None if not measured."""
    name, sign = _RATES.get(curve.place.channel, ("", 0.0))
    rates = (values for key, values in curve.signals.items() if name and name in key)
    return next(rates, None), sign


def _half_width(rows: Array) -> float:
    """Return the half width of the 95 % interval of the mean of autocorrelated rows [W]."""
    means = [part.mean() for part in np.array_split(rows, min(_BATCHES, len(rows)))]
    if len(means) < 2:
        return np.inf
    error = float(np.std(means, ddof=1)) / np.sqrt(len(means))
    return float(student.ppf(0.975, len(means) - 1) * error)
