"""What a run amounts to: errors, tensions and shares, in constant memory."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 2000


class RunStatistics:
    """Largest and mean-square pose errors, tension range, and their envelopes over time.

    Attributes:
        envelope: shape (BINS, 2, 6 + n): lowest and highest pose error and tension per time bin.
        bin_steps: plant steps per bin.
        squares: sums of the squared pose errors, (6,).
        counts: steps, and those with a slack cable and with an infeasible wrench.
    """

    def __init__(self, steps: int, n_cables: int) -> None:
        """Prepare for `steps` steps of a machine with `n_cables` cables."""
        self.bin_steps = max(1, -(-steps // BINS))
        self.envelope: Array = np.empty((BINS, 2, 6 + n_cables))
        self.envelope[:, 0], self.envelope[:, 1] = np.inf, -np.inf
        self.squares = np.zeros(6)
        self.counts = np.zeros(3, dtype=np.int64)

    def add(self, error: Array, tensions: Array, slack: bool, infeasible: bool) -> None:
        """Count one step with pose error (6,) [m, rad] and tensions (n,) [N]."""
        add_step(self.envelope[self.steps // self.bin_steps], error, tensions, self.squares)
        self.counts += (1, slack, infeasible)

    @property
    def steps(self) -> int:
        """How many steps were counted."""
        return int(self.counts[0])

    @property
    def max_error(self) -> Array:
        """Largest absolute pose error (6,) [m, rad]."""
        used = self._used()[:, :, :6]
        return np.abs(used).max(axis=(0, 1)) if len(used) else np.zeros(6)

    @property
    def rms_error(self) -> Array:
        """Root mean square pose error (6,) [m, rad]."""
        return np.sqrt(self.squares / max(1, self.steps))

    @property
    def tension_range(self) -> tuple[float, float]:
        """Lowest and highest tension of any cable [N]."""
        used = self._used()[:, :, 6:]
        return (float(used.min()), float(used.max())) if used.size else (0.0, 0.0)

    @property
    def lowest_tensions(self) -> Array:
        """Lowest tension of each cable (n,) [N]; before the first step 0."""
        used = self._used()[:, 0, 6:]
        return np.asarray(used.min(axis=0)) if len(used) else np.zeros(self.envelope.shape[2] - 6)

    @property
    def highest_tensions(self) -> Array:
        """Highest tension of each cable (n,) [N]; before the first step 0."""
        used = self._used()[:, 1, 6:]
        return np.asarray(used.max(axis=0)) if len(used) else np.zeros(self.envelope.shape[2] - 6)

    @property
    def slack_share(self) -> float:
        """Share of time with any cable slack."""
        return float(self.counts[1] / max(1, self.steps))

    @property
    def infeasible_share(self) -> float:
        """Share of time with a wrench that no allowed tensions give."""
        return float(self.counts[2] / max(1, self.steps))

    def _used(self) -> Array:
        return self.envelope[: -(-self.steps // self.bin_steps)]


@njit(cache=True)
def add_step(envelope: Array, error: Array, tensions: Array, squares: Array) -> None:
    """Count pose error (6,) and tensions (n,) in a bin's envelope (2, 6 + n) and the squares."""
    for d in range(6):
        squares[d] += error[d] * error[d]
        envelope[0, d] = min(envelope[0, d], error[d])
        envelope[1, d] = max(envelope[1, d], error[d])
    for i in range(tensions.shape[0]):
        envelope[0, 6 + i] = min(envelope[0, 6 + i], tensions[i])
        envelope[1, 6 + i] = max(envelope[1, 6 + i], tensions[i])
