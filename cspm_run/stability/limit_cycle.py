"""An oscillation that neither dies out nor grows, in the tensions at the end of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Slower than this [Hz] the sea, a reference or a bar that swings freely moves the tensions.
LOWEST = 2.0
# A line needs so many periods, and holds so many bins of the spectrum to each side: the main lobe
# of Hann's window is two.
PERIODS, LOBE = 10, 3
# A line with half of the power above the lowest frequency is one motion and not noise; one that is
# a twentieth of the tension is no ripple.
LEAST_SHARE, LEAST_RIPPLE = 0.5, 0.05
# Between the halves it changes by less than this, or it comes and goes.
LARGEST_CHANGE = 2.0


class Oscillation(NamedTuple):
    """A line in the spectrum of a cable's tension.

    Attributes:
        cable: its number.
        frequency: [Hz].
        amplitude: [N].
    """

    cable: int
    frequency: float
    amplitude: float


def oscillation(tensions: Array, period: float) -> Oscillation | None:
    """Return the largest oscillation of the tensions that keeps its size, None where none does.

    Args:
        tensions: (k, n) [N].
        period: from one instant to the next [s].
    """
    found = [
        Oscillation(cable, *line)
        for cable, tension in enumerate(tensions.T)
        if (line := _line(tension, period)) is not None
    ]
    return max(found, key=lambda each: each.amplitude, default=None)


def _line(tension: Array, period: float) -> tuple[float, float] | None:
    """Return frequency [Hz] and amplitude [N] of the peak in a tension's spectrum."""
    frequencies, power = _spectrum(tension, period)
    judged = np.flatnonzero(frequencies >= max(LOWEST, PERIODS / (len(tension) * period)))
    if not len(judged):
        return None
    peak = int(judged[np.argmax(power[judged])])
    inside = judged[np.abs(judged - peak) <= LOBE]
    alone = power[inside].sum()
    if not alone >= LEAST_SHARE * power[judged].sum():
        return None
    amplitude = float(np.sqrt(2.0 * alone))
    halves = np.array_split(tension, 2)
    sizes = [_amplitude_at(float(frequencies[peak]), half, period) for half in halves]
    kept = max(sizes) < LARGEST_CHANGE * min(sizes)
    ripple = amplitude < LEAST_RIPPLE * float(np.mean(tension))
    return None if ripple or not kept else (float(frequencies[peak]), amplitude)


def _spectrum(tension: Array, period: float) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the power of each bin [N²], by Hann's window."""
    count = len(tension)
    window = np.hanning(count)
    values = np.fft.rfft(window * (tension - tension.mean()))
    power: Array = 2.0 * np.abs(values) ** 2 / (count * np.sum(window**2))
    return np.asarray(np.fft.rfftfreq(count, period), dtype=float), power


def _amplitude_at(frequency: float, tension: Array, period: float) -> float:
    """Return the amplitude [N] of what there is within a lobe about a frequency [Hz]."""
    frequencies, power = _spectrum(tension, period)
    near = np.abs(frequencies - frequency) <= LOBE / (len(tension) * period)
    return float(np.sqrt(2.0 * power[near].sum()))
