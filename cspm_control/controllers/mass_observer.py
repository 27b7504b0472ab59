"""The bar's mass, estimated from its heave while it is carried."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# What heave leaves unexplained besides [m/s²], standard deviation, and within which band [rad/s].
UNEXPLAINED, BAND = 0.1, 40.0
# Prior standard deviations: of nominal mass over mass, and of a steady acceleration [m/s²].
SHARE, STEADY = 0.3, 0.3
# How far both wander [1/√s], [m/s²/√s].
SHARE_WANDER, STEADY_WANDER = 0.01, 0.05


class MassObserver:
    """A Kalman filter for the mass m of a bar that the cables carry with the force F.

    The bar falls with g − F/m + c, so that what it falls less than g is (F/m₀)·(m₀/m) − c for the
    nominal m₀. A steady force (c) and a wrong mass differ in that only the mass counts for more
    where more is carried: distinguished once the bar has been accelerated up and down. Before, the
    prior shares out what is seen.
    """

    def __init__(self, nominal: float, largest: float, *, period: float, settling: float) -> None:
        """Make the filter.

        Args:
            nominal: mass m₀ [kg].
            largest: share of it that is believed to be too much or too little, below 1.
            period: time between steps [s].
            settling: time after a restart before what comes is believed [s].
        """
        self._nominal, self._period = nominal, period
        self._bounds = 1.0 / (1.0 + largest), 1.0 / (1.0 - largest)
        self._noise = UNEXPLAINED**2 * 2.0 / (BAND * period)
        self._wander = np.diag([SHARE_WANDER, STEADY_WANDER]) ** 2 * period
        self._mean, self._spread = np.array([1.0, 0.0]), np.diag([SHARE, STEADY]) ** 2
        self._settling_steps = round(settling / period)
        self._wait = self._settling_steps

    @property
    def mass(self) -> float:
        """The mass [kg], within what is believed."""
        low, high = self._bounds
        return self._nominal / min(high, max(low, float(self._mean[0])))

    def restart(self) -> None:
        """Wait until the estimate has settled again; what was learnt stays."""
        self._wait = self._settling_steps

    def step(self, force: float, carried: float) -> None:
        """Take the force F upwards [N], and by how much less than g the bar falls [m/s²]."""
        if self._wait > 0:
            self._wait -= 1
            return
        row = np.array([force / self._nominal, -1.0])
        self._spread += self._wander
        reach = self._spread @ row
        gain = reach / (row @ reach + self._noise)
        self._mean += gain * (carried - row @ self._mean)
        self._spread -= np.outer(gain, reach)
