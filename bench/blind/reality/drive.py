"""What lies between the torque that is commanded and the torque of the motors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of the lag, what the current loop takes; the rest is that of the filter behind it.
_LOOP = 0.9


class SlowDrive:
    """Drives in which a current loop and a filter follow each other, both of first order."""

    def __init__(self, lag: Array) -> None:
        """Take what the torque is late by while it changes slowly (n,) [s]; 0: it is not."""
        self._late = lag > 0.0
        time = np.where(self._late, lag, 1.0)
        self._loop_time, self._filter_time = _LOOP * time, (1.0 - _LOOP) * time
        self._loop: Array | None = None
        self._torque: Array = np.zeros(len(lag))

    def deliver(self, command: Array) -> Array:
        """Return the torque (n,) [N·m] at the instant at which a command is given."""
        if self._loop is None:
            return command
        return np.where(self._late, self._torque, command)

    def advance(self, command: Array, period: float) -> None:
        """Follow for a period [s] a command (n,) [N·m] that is held; exact for a held one."""
        if self._loop is None:
            self._loop, self._torque = command.copy(), command.copy()
        loop_kept, filter_kept = (
            np.exp(-period / time) for time in (self._loop_time, self._filter_time)
        )
        behind = self._loop - command
        carried = behind * self._loop_time / (self._loop_time - self._filter_time)
        rest = self._torque - command - carried
        self._torque = command + carried * loop_kept + rest * filter_kept
        self._loop = command + behind * loop_kept
