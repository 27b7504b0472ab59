"""Prescribed motor torques: a constant plus sines per cable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Signal

Array = NDArray[np.float64]


class TorqueGenerator:
    """Motor torque per cable as a function of time."""

    def __init__(self, signals: Mapping[str, Signal], cables: Sequence[str]) -> None:
        """Take the signals by cable name; cables without one get zero torque.

        Raises:
            InputError: a signal names no cable of this machine.
        """
        for name in signals:
            if name not in cables:
                raise InputError(
                    f"control.torque.{name}: no such cable, allowed: {', '.join(cables)}"
                )
        chosen = [signals.get(name, Signal()) for name in cables]
        self._offsets = np.array([signal.offset for signal in chosen])
        sines = [(i, sine) for i, signal in enumerate(chosen) for sine in signal.sines]
        self._cables = np.array([i for i, _ in sines], dtype=np.int64)
        self._amplitudes = np.array([sine.amplitude for _, sine in sines])
        self._rates = np.array([2.0 * np.pi * sine.frequency for _, sine in sines])
        self._phases = np.array([sine.phase for _, sine in sines])

    def step(self, stamp_ns: int) -> Array:
        """Return the torques (n,) [N·m] at `stamp_ns`."""
        torque = self._offsets.copy()
        angles = self._rates * (stamp_ns * 1e-9) + self._phases
        np.add.at(torque, self._cables, self._amplitudes * np.sin(angles))
        return torque
