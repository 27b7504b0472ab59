"""The thesis's force controllers: PI per cable from tension error to motor torque (7-4)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.control_spec.force import PiGains

Array = NDArray[np.float64]


class ForceController:
    """PI per cable.

    The first output is the torque that balances the measured tension: no jump at the start. At the
    torque limit the integrator moves only back into range.

    Attributes:
        torque_limits: largest torque of each motor, (n,) [N·m].
        saturated: how many torques of the last step stand at their limit.
        gains: of each its proportional gain, its integral frequency, and the torque that goes ahead
            per wanted tension, (n, 3).
        period: time between steps [s].
        integral: the integral terms, (n,) [N·m].
        terms: proportional and integral terms of the last torques, shape (2, n) [N·m].
    """

    def __init__(
        self, gains: Sequence[PiGains], radii: Array, torque_limits: Array, *, period: float
    ) -> None:
        """Make the controllers.

        Args:
            gains: per cable.
            radii: cable wound per radian of the motor, shape (n,) [m].
            torque_limits: shape (n,) [N·m].
            period: time between steps [s].
        """
        self.gains = np.array(
            [
                (g.kp, g.integral_frequency, g.feedforward * radius)
                for g, radius in zip(gains, radii, strict=True)
            ]
        )
        self._radii = radii
        self.torque_limits = torque_limits
        self.period = period
        self.integral, self._nothing = np.zeros(len(radii)), np.zeros(len(radii))
        self._started = False
        self.saturated = 0
        self.terms = np.zeros((2, len(radii)))

    def restart(self) -> None:
        """Let the next output balance the measured tension again."""
        self._started = False

    def release(self, cables: NDArray[np.bool_]) -> None:
        """Give the cables where `cables` (n,) is true no torque from now on."""
        self.gains[cables] = 0.0
        self.integral[cables] = 0.0

    def step(self, wanted: Array, measured: Array, ahead: Array | None = None) -> Array:
        """Return motor torques (n,) [N·m] for wanted and measured tensions (n,) [N].

        `ahead` (n,) [N·m] is fed forward.
        """
        ahead = self._nothing if ahead is None else ahead
        if not self._started:
            proportional = self.gains[:, 0] * (wanted - measured)
            balancing = self._radii * measured - self.gains[:, 2] * wanted
            self.integral[:] = balancing - proportional - ahead
            self._started = True
        torque = np.empty(len(wanted))
        self.saturated = pi_torques(
            wanted,
            measured,
            ahead,
            self.gains,
            self.torque_limits,
            self.period,
            self.integral,
            self.terms,
            torque,
        )
        return torque


@njit(cache=True, error_model="numpy")
def pi_torques(
    wanted: Array,
    measured: Array,
    ahead: Array,
    gains: Array,
    limits: Array,
    period: float,
    integral: Array,
    terms: Array,
    out: Array,
) -> int:
    """Write torques and their terms, and advance the integrals; return how many are limited."""
    saturated = 0
    for i in range(wanted.shape[0]):
        error = wanted[i] - measured[i]
        terms[0, i], terms[1, i] = gains[i, 0] * error, integral[i]
        torque = gains[i, 0] * error + integral[i] + (gains[i, 2] * wanted[i] + ahead[i])
        out[i] = min(limits[i], max(-limits[i], torque))
        if out[i] != torque:
            saturated += 1
        if out[i] == torque or (torque > 0.0) != (error > 0.0):
            integral[i] += gains[i, 0] * gains[i, 1] * error * period
    return saturated
