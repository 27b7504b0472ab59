"""Readings that repeat although the sensor is noisy: a sensor that sends and measures no more."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
# White noise turns at two of three readings, smooth motion hardly ever (Kendall's turning points).
# Half of what noise makes in so many readings shows that there was some.
WINDOW, TURNS = 30.0, 10.0
# Of readings that are independent, one in so many is said to be repeated by mistake: at 1 kHz one
# in thirty years.
_ONCE_IN = 1e12


class RepeatedReading:
    """Finds a noisy reading that stays the same, to the last bit, for as long as silence may last.

    Only where readings have shown noise before, however long ago: while the bar moves its motion
    hides the noise. A driver that repeats a constant from the start, or simulates without noise, is
    not stuck.

    Noise of standard deviation σ, rounded to r, gives two equal readings of a quantity at rest with
    the probability r/(2·√π·σ), that of all quantities with the product.
    """

    def __init__(self, topic: str, noise: ArrayLike, resolution: ArrayLike, allowed: float) -> None:
        """Take what the sensor is like.

        Args:
            topic: what it measures.
            noise: standard deviation of each quantity, shape (k,); 0 for one without noise.
            resolution: of each, shape (k,); 0 for any value.
            allowed: how long a reading may be old [s].
        """
        self._topic, self._allowed_ns = topic, round(allowed * 1e9)
        self._least = repeats_needed(noise, resolution)
        self._row: Array | None = None
        self._change: Array | None = None
        self._turns: Array | None = None
        self._noisy = False
        self._since_ns, self._count = 0, 0

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a row; return for how long it has been the same, None while it need not be stuck."""
        if self._row is None or (row != self._row).any():
            self._note(row)
            self._since_ns, self._count = stamp_ns, 0
            return None
        self._count += 1
        age = stamp_ns - self._since_ns
        if self._count < self._least or age <= self._allowed_ns or not self._noisy:
            return None
        return (
            f"{self._topic}: the same reading for {age * 1e-6:.0f} ms, allowed:"
            f" {self._allowed_ns * 1e-6:g} ms (safety.stale_after)"
        )

    def _note(self, row: Array) -> None:
        """Take another reading: count the turns of late of each quantity, and keep it."""
        if self._row is not None:
            change = row - self._row
            if self._change is not None:
                turned = change * self._change < 0.0
                before = np.zeros(len(row)) if self._turns is None else self._turns
                self._turns = before * (1.0 - 1.0 / WINDOW) + turned
                self._noisy = self._noisy or bool(self._turns.max() >= TURNS)
            self._change = change
        self._row = row.copy()


def repeats_needed(noise: ArrayLike, resolution: ArrayLike) -> float:
    """Return how often a reading has to repeat until it cannot be chance; infinite without noise.

    Args:
        noise: standard deviations, shape (k,).
        resolution: steps, shape (k,).
    """
    deviations, steps = np.asarray(noise, dtype=float), np.asarray(resolution, dtype=float)
    noisy = deviations > 0.0
    chances = np.minimum(1.0, steps[noisy] / (2.0 * math.sqrt(math.pi) * deviations[noisy]))
    chance = float(np.prod(chances))
    if chance >= 1.0:
        return math.inf
    return 1.0 if chance == 0.0 else math.ceil(math.log(_ONCE_IN) / -math.log(chance))
