"""Prescribed motor torques: a constant plus sines per cable."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Signal

Array = NDArray[np.float64]


class TorqueGenerator:
    """Motor torque per cable as a function of time.

    Attributes:
        arrays: the cable of each sine (m,), offsets (n,) [N·m], and of each sine amplitude (m,)
            [N·m], angular frequency (m,) [rad/s] and phase (m,) [rad].
    """

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
        offsets = np.array([float(signal.offset) for signal in chosen])
        sines = [(i, sine) for i, signal in enumerate(chosen) for sine in signal.sines]
        places = np.array([i for i, _ in sines], dtype=np.int64)
        amplitudes = np.array([float(sine.amplitude) for _, sine in sines])
        rates = np.array([2.0 * np.pi * sine.frequency for _, sine in sines])
        phases = np.array([float(sine.phase) for _, sine in sines])
        self.arrays = (places, offsets, amplitudes, rates, phases)

    def step(self, stamp_ns: int) -> Array:
        """Return the torques (n,) [N·m] at `stamp_ns`."""
        torque = np.empty(len(self.arrays[1]))
        profile_torques(stamp_ns * 1e-9, *self.arrays, torque)
        return torque


@njit(cache=True, error_model="numpy")
def profile_torques(
    seconds: float,
    cables: NDArray[np.int64],
    offsets: Array,
    amplitudes: Array,
    rates: Array,
    phases: Array,
    out: Array,
) -> None:
    """Write the torques (n,) [N·m] at a time; arrays as `TorqueGenerator.arrays`."""
    for i in range(offsets.shape[0]):
        out[i] = offsets[i]
    for i in range(cables.shape[0]):
        out[cables[i]] += amplitudes[i] * math.sin(rates[i] * seconds + phases[i])
