"""One quantity of a message that stays the same although its sensor is noisy: one stuck cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from cspm_control.plausibility.repeated_reading import TURNS, WINDOW, repeats_needed

Array = NDArray[np.float64]
# A quantity whose noise turns at a third of its readings repeats less than every second one,
# whatever its driver rounds to: 40 repetitions come by chance once in 10¹².
_LEAST = 40.0


class RepeatedQuantity:
    """Finds a noisy quantity that stays the same while others of its message go on.

    As `RepeatedReading`, each quantity for itself: only where it has shown noise before, and has
    noise in the test-bed. Zero may repeat: a drive at rest and a slack cable read it exactly.
    """

    def __init__(
        self,
        topic: str,
        names: Sequence[str],
        noise: ArrayLike,
        resolution: ArrayLike,
        allowed: float,
    ) -> None:
        """Take what the sensor is like.

        Args:
            topic: what it measures.
            names: of the quantities that are looked at, the first k of a message.
            noise: standard deviation of each, shape (k,); 0 for one without noise.
            resolution: of each, shape (k,); 0 for any value.
            allowed: how long a reading may be old [s].
        """
        self._topic, self._names, self._allowed_ns = topic, tuple(names), round(allowed * 1e9)
        pairs = zip(np.ravel(noise), np.ravel(resolution), strict=True)
        self._least = np.array([max(_LEAST, repeats_needed([s], [r])) for s, r in pairs])
        # Last reading, change before it, turns of late, whether noise was shown, repetitions.
        self._memory = np.zeros((5, len(self._least)))
        self._memory[0] = np.nan
        self._since = np.zeros(len(self._least), dtype=np.int64)
        # Compiled now and not by the first message.
        note_repetitions(0, self._memory[0].copy(), self._memory, self._since)

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a row; return which quantity has been the same for how long, None where none is."""
        note_repetitions(stamp_ns, row, self._memory, self._since)
        enough = self._memory[4] >= self._least
        if not enough.any():
            return None
        ages = np.where(enough & (self._memory[3] > 0.0), stamp_ns - self._since, 0)
        worst = int(np.argmax(ages))
        if ages[worst] <= self._allowed_ns:
            return None
        return (
            f"{self._topic}: the same {self._names[worst]} for {ages[worst] * 1e-6:.0f} ms,"
            f" allowed: {self._allowed_ns * 1e-6:g} ms (safety.stale_after): a stuck sensor?"
        )


@njit(cache=True, error_model="numpy")
def note_repetitions(stamp_ns: int, row: Array, memory: Array, since: NDArray[np.int64]) -> None:
    """Count repetitions and turns of each quantity in `memory` (5, k); see `RepeatedQuantity`."""
    for i in range(memory.shape[1]):
        change = row[i] - memory[0, i]
        if change == 0.0 and row[i] != 0.0:
            memory[4, i] += 1.0
        else:
            memory[4, i] = 0.0
            since[i] = stamp_ns
        turned = 1.0 if change * memory[1, i] < 0.0 else 0.0
        memory[2, i] = memory[2, i] * (1.0 - 1.0 / WINDOW) + turned
        if memory[2, i] >= TURNS:
            memory[3, i] = 1.0
        memory[1, i] = change
        memory[0, i] = row[i]
