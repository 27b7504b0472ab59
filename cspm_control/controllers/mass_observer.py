"""The bar's mass, estimated from its heave while it is carried."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Wait = NDArray[np.int64]

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

    Attributes:
        numbers: nominal mass [kg], bounds of m₀/m, variance of a sample, and how much those of m₀/m
            and c grow in a step.
        wait: how many more steps nothing is believed, (1,).
        mean, spread: of m₀/m and c, (2,) and (2, 2).
    """

    def __init__(self, nominal: float, largest: float, *, period: float, settling: float) -> None:
        """Make the filter.

        Args:
            nominal: mass m₀ [kg].
            largest: share of it that is believed to be too much or too little, below 1.
            period: time between steps [s].
            settling: time after a restart before what comes is believed [s].
        """
        low, high = 1.0 / (1.0 + largest), 1.0 / (1.0 - largest)
        noise = UNEXPLAINED**2 * 2.0 / (BAND * period)
        wander = [SHARE_WANDER**2 * period, STEADY_WANDER**2 * period]
        self.numbers = np.array([nominal, low, high, noise, *wander])
        self.mean, self.spread = np.array([1.0, 0.0]), np.diag([SHARE, STEADY]) ** 2
        self._settling_steps = round(settling / period)
        self.wait = np.array([self._settling_steps], dtype=np.int64)

    @property
    def arrays(self) -> tuple[Array, Wait, Array, Array]:
        """What `learn_mass` works on, in its order."""
        return self.numbers, self.wait, self.mean, self.spread

    @property
    def mass(self) -> float:
        """The mass [kg], within what is believed."""
        return float(believed_mass(self.mean, self.numbers))

    def restart(self) -> None:
        """Wait until the estimate has settled again; what was learnt stays."""
        self.wait[0] = self._settling_steps

    def step(self, force: float, carried: float) -> None:
        """Take the force F upwards [N], and by how much less than g the bar falls [m/s²]."""
        learn_mass(force, carried, *self.arrays)


@njit(cache=True, error_model="numpy", _nrt=False)
def believed_mass(mean: Array, numbers: Array) -> float:
    """Return the mass [kg] within what is believed; `numbers` as in `MassObserver`."""
    return numbers[0] / min(numbers[2], max(numbers[1], mean[0]))


@njit(cache=True, error_model="numpy", _nrt=False)
def learn_mass(
    force: float, carried: float, numbers: Array, wait: Wait, mean: Array, spread: Array
) -> None:
    """Update mean (2,) and spread (2, 2) of m₀/m and c by a sample, once nothing is waited for."""
    if wait[0] > 0:
        wait[0] -= 1
        return
    share = force / numbers[0]
    spread[0, 0] += numbers[4]
    spread[1, 1] += numbers[5]
    # The row that the sample is of: (share, −1).
    first, second = spread[0, 0] * share - spread[0, 1], spread[1, 0] * share - spread[1, 1]
    total = share * first - second + numbers[3]
    surprise = carried - (share * mean[0] - mean[1])
    mean[0] += first / total * surprise
    mean[1] += second / total * surprise
    spread[0, 0] -= first / total * first
    spread[0, 1] -= first / total * second
    spread[1, 0] -= second / total * first
    spread[1, 1] -= second / total * second
