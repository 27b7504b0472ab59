"""The thesis's force controllers: PI per cable from tension error to motor torque (7-4)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.scenario import PiGains

Array = NDArray[np.float64]


class ForceController:
    """PI per cable.

    The first output is the torque that balances the measured tension: no jump at the start. At the
    torque limit the integrator moves only back into range.
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
        self._gains = np.array([(g.kp, g.integral_frequency) for g in gains])
        self._radii = radii
        self._limits = torque_limits
        self._period = period
        self._integral, self._nothing = np.zeros(len(radii)), np.zeros(len(radii))
        self._started = False
        self.saturated = 0

    def restart(self) -> None:
        """Let the next output balance the measured tension again."""
        self._started = False

    def step(self, wanted: Array, measured: Array, ahead: Array | None = None) -> Array:
        """Return motor torques (n,) [N·m] for wanted and measured tensions (n,) [N].

        `ahead` (n,) [N·m] is fed forward. `saturated` then says how many torques stand at their
        limit.
        """
        ahead = self._nothing if ahead is None else ahead
        if not self._started:
            proportional = self._gains[:, 0] * (wanted - measured)
            self._integral[:] = self._radii * measured - proportional - ahead
            self._started = True
        torque = np.empty(len(wanted))
        self.saturated = _pi(
            wanted, measured, ahead, self._gains, self._limits, self._period, self._integral, torque
        )
        return torque


@njit(cache=True, error_model="numpy")
def _pi(
    wanted: Array,
    measured: Array,
    ahead: Array,
    gains: Array,
    limits: Array,
    period: float,
    integral: Array,
    out: Array,
) -> int:
    saturated = 0
    for i in range(wanted.shape[0]):
        error = wanted[i] - measured[i]
        torque = gains[i, 0] * error + integral[i] + ahead[i]
        out[i] = min(limits[i], max(-limits[i], torque))
        if out[i] != torque:
            saturated += 1
        if out[i] == torque or (torque > 0.0) != (error > 0.0):
            integral[i] += gains[i, 0] * gains[i, 1] * error * period
    return saturated
