"""The tensions nearest to a preferred one, by quadratic programming."""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EQUALITY = 5
OPTIMAL = 1
# Where no tensions give the wrench: how much more a missed newton counts than one that a tension
# is away from the preferred one.
NEAREST_WRENCH = 1e6
AT_LIMIT = 1e-9


class PreferredTension:
    """min |t − t_preferred|² with A·t = w and t within its limits, by DAQP's dual active sets."""

    def __init__(self, preferred: float) -> None:
        """Take the preferred tension of every cable [N]."""
        self._preferred = preferred

    def __call__(
        self,
        structure: Array,
        wrench: Array,
        limits: Array,
        weights: Array,
        memory: Array,
        out: Array,
    ) -> int:
        """Write the tensions (n,) [N]; return how many stand at a limit.

        Where no tensions give the wrench, those of the nearest one: Σ Wᵢ(A·t − w)ᵢ² is least.
        """
        n, m = len(out), len(wrench)
        linear = np.full(n, -self._preferred)
        upper = np.concatenate((limits[:, 1], wrench))
        lower = np.concatenate((limits[:, 0], wrench))
        sense = np.zeros(n + m, dtype=np.int32)
        sense[n:] = EQUALITY
        found, _, flag, _ = daqp.solve(np.eye(n), linear, structure, upper, lower, sense)
        if flag != OPTIMAL:
            weighted = NEAREST_WRENCH * structure.T * weights
            found, _, _, _ = daqp.solve(
                np.eye(n) + weighted @ structure,
                linear - weighted @ wrench,
                np.zeros((0, n)),
                upper[:n].copy(),
                lower[:n].copy(),
                sense[:n].copy(),
            )
        np.clip(found, limits[:, 0], limits[:, 1], out=out)
        edge = np.minimum(out - limits[:, 0], limits[:, 1] - out)
        return int((edge < AT_LIMIT).sum())
