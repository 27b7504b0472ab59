"""Which cables are lost, by what their load cells show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class LostCables:
    """Counts how long each cable has carried nothing.

    A cable that is lost stays lost, since nobody mends it during a run. At least `least_left` are
    kept: with fewer no tensions give every wrench.

    Attributes:
        below: the tension that a whole cable has [N].
        steps: after so many steps in a row below it a cable is lost.
        most: how many may be lost.
        counts: for how many steps each has been below it, (n,).
        lost: which are, (n,).
    """

    def __init__(self, n: int, below: float, steps: int, least_left: int) -> None:
        """Begin with all cables whole.

        Args:
            n: how many cables there are.
            below: the tension that a whole cable has [N].
            steps: after so many steps in a row below it a cable is lost, ≥ 1.
            least_left: how many cables are never given up.
        """
        self.below, self.steps = below, steps
        self.most = max(0, n - least_left)
        self.counts = np.zeros(n, dtype=np.int64)
        self.lost: NDArray[np.bool_] = np.zeros(n, dtype=bool)

    def step(self, measured: Array) -> bool:
        """Take measured tensions (n,) [N]; return whether a cable was lost by them.

        A tension that is not a number says nothing of its cable.
        """
        self.counts[:] = np.where(measured < self.below, self.counts + 1, 0)
        found = np.flatnonzero((self.counts >= self.steps) & ~self.lost)
        found = found[: self.most - int(self.lost.sum())]
        self.lost[found] = True
        return len(found) > 0
