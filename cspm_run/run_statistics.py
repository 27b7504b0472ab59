"""What a run amounts to: errors, tensions and shares, in constant memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.testbed import Testbed
from cspm_run.stability.saturation import KINDS, DriveSaturation, of_tally

Array = NDArray[np.float64]

BINS = 2000
# Tensions that are kept of the end: four seconds at a thousand instants per second.
KEPT, KEPT_PERIOD = 4096, 1e-3


class RunStatistics:
    """Largest and mean-square pose errors, tension range, and their envelopes over time.

    Attributes:
        envelope: shape (BINS, 2, 6 + n): lowest and highest pose error and tension per time bin.
        bin_steps: plant steps per bin.
        squares: sums of the squared pose errors, (6,).
        counts: steps, and those with a slack cable, with an infeasible wrench and with a motor at
            its limit.
        drives: what was counted of drives at their torque limit, see `count_at_limit`.
        kept: tensions (KEPT, n) [N], one instant of `kept_steps`; the oldest are replaced.
        kept_steps: from one instant that is kept to the next.
        period: of a step [s].
    """

    def __init__(self, steps: int, n_cables: int, period: float = KEPT_PERIOD) -> None:
        """Prepare for `steps` steps of `period` [s] of a machine with `n_cables` cables."""
        self.bin_steps = max(1, -(-steps // BINS))
        self.envelope: Array = np.empty((BINS, 2, 6 + n_cables))
        self.envelope[:, 0], self.envelope[:, 1] = np.inf, -np.inf
        self.squares = np.zeros(6)
        self.counts = np.zeros(4, dtype=np.int64)
        self.drives = np.zeros(KINDS * n_cables, dtype=np.int64)
        self.kept_steps = max(1, round(KEPT_PERIOD / period))
        self.period = period
        self.kept: Array = np.zeros((KEPT, n_cables))

    def add(
        self,
        error: Array,
        tensions: Array,
        slack: bool,
        infeasible: bool,
        saturated: bool = False,
    ) -> None:
        """Count one step with pose error (6,) [m, rad] and tensions (n,) [N]."""
        add_step(self.envelope[self.steps // self.bin_steps], error, tensions, self.squares)
        keep_step(self.kept, self.steps, self.kept_steps, tensions)
        self.counts += (1, slack, infeasible, saturated)

    @property
    def steps(self) -> int:
        """How many steps were counted."""
        return int(self.counts[0])

    @property
    def span(self) -> float:
        """Time that was counted [s]."""
        return self.steps * self.period

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

    @property
    def saturated_share(self) -> float:
        """Share of time with any motor at its torque limit."""
        return float(self.counts[3] / max(1, self.steps))

    def saturation(self, names: Sequence[str]) -> list[DriveSaturation]:
        """Return how each drive met its torque limit, by the cables' names in their order."""
        return of_tally(self.drives, self.steps, self.period, names)

    @property
    def kept_period(self) -> float:
        """From one instant that is kept to the next [s]."""
        return self.kept_steps * self.period

    @property
    def last_tensions(self) -> Array:
        """The tensions kept of the end, (k, n) [N], the oldest first."""
        count = -(-self.steps // self.kept_steps)
        return self.kept[:count] if count <= KEPT else np.roll(self.kept, -(count % KEPT), axis=0)

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


@njit(cache=True)
def keep_step(kept: Array, step: int, kept_steps: int, tensions: Array) -> None:
    """Keep the tensions (n,) of a step in `kept` (k, n), if it is one of those that are kept."""
    if step % kept_steps == 0:
        row = kept[step // kept_steps % kept.shape[0]]
        for i in range(tensions.shape[0]):
            row[i] = tensions[i]


def torque_limits(testbed: Testbed) -> Array:
    """Return the largest torque of each motor, (n,) [N·m]."""
    return np.array([cable.torque_limit for cable in testbed.cables], dtype=float)
