"""A sine on the motor torques that keeps winches from sticking (thesis, section 9)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.control_spec.force import Dither as DitherSpec
from cspm_msgs_py.control_spec.per_cable import values_per_cable
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

KEY = "control.force.dither"
NANOSECONDS = 1_000_000_000


class Dither:
    """amplitude·sin(2π·frequency·t) on each torque, t being the time stamped on it.

    Nothing is remembered, so that every way of running a scenario sends the same torques.

    Attributes:
        arrays: amplitudes [N·m], frequencies [Hz] and torque limits [N·m], each (n,).
    """

    def __init__(self, amplitudes: Array, frequencies: Array, torque_limits: Array) -> None:
        """Take what is added.

        Args:
            amplitudes: shape (n,) [N·m] at the motor shaft; 0 for a cable without dither.
            frequencies: shape (n,) [Hz].
            torque_limits: shape (n,) [N·m].
        """
        self.arrays = (
            np.asarray(amplitudes, dtype=float),
            np.asarray(frequencies, dtype=float),
            np.asarray(torque_limits, dtype=float),
        )

    def added_to(self, torque: Array, now_ns: int) -> Array:
        """Return torques (n,) [N·m] with the sine of an instant [ns] on them.

        Args:
            torque: within the limits, shape (n,) [N·m].
            now_ns: stamp of the torques [ns].

        Near a limit the amplitude is what is left up to it: a sine cut on one side would change the
        mean torque.
        """
        dithered = np.array(torque, dtype=float)
        add_dither(now_ns, *self.arrays, dithered)
        return dithered


@njit(cache=True, error_model="numpy")
def add_dither(
    now_ns: int, amplitudes: Array, frequencies: Array, limits: Array, torque: Array
) -> None:
    """Add the sine of an instant [ns] to torques (n,) [N·m]; arrays as `Dither.arrays`."""
    seconds, rest = now_ns // NANOSECONDS, now_ns % NANOSECONDS
    for i in range(torque.shape[0]):
        # Whole cycles are left out first: the clock of a real machine counts 10⁹ s and more.
        cycles = (frequencies[i] * seconds) % 1.0 + frequencies[i] * (rest / NANOSECONDS)
        room = min(amplitudes[i], limits[i] - abs(torque[i]))
        torque[i] += room * math.sin(2.0 * math.pi * cycles)


def make_dither(
    wanted: DitherSpec, names: Sequence[str], torque_limits: Array, rate: float
) -> Dither:
    """Return the dither that a scenario describes, for cables `names` at `rate` [Hz].

    Raises:
        InputError: a name that is no cable, an amplitude beyond the torque limit, or a frequency
            that is missing or at least half the rate.
    """
    amplitudes = values_per_cable(wanted.amplitude, names, 0.0, f"{KEY}.amplitude")
    frequencies = values_per_cable(wanted.frequency, names, 0.0, f"{KEY}.frequency")
    for name, amplitude, frequency, limit in zip(
        names, amplitudes, frequencies, torque_limits, strict=True
    ):
        if amplitude > limit:
            raise InputError(
                f"{KEY}.amplitude: {amplitude:g} N·m of {name}, allowed: at most its torque limit"
                f" of {limit:g} N·m"
            )
        if amplitude and not 0.0 < frequency < 0.5 * rate:
            given = f"{frequency:g} Hz of {name}" if frequency else f"missing for {name}"
            raise InputError(
                f"{KEY}.frequency: {given}, allowed: above 0 and below {0.5 * rate:g} Hz, half the"
                " rate of force_controller"
            )
    return Dither(np.array(amplitudes), np.array(frequencies), torque_limits)
