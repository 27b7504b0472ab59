"""The wanted motions of winch frame and bar, as reference rows at any stamp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.rows import reference_row
from cspm_model.motion import Motion

Array = NDArray[np.float64]


class WaveTrajectory:
    """A prescribed motion as pose, twist and acceleration in world_ned."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.values: Array = np.zeros(18)

    def step(self, stamp_ns: int) -> Array:
        """Return the reference row (19,) at `stamp_ns`; `values` keeps pose and derivatives."""
        motion = self.motion
        evaluate_motion(stamp_ns * 1e-9, motion.knots, motion.spacing, motion.periodic, self.values)
        row = np.empty(19)
        reference_row(self.values, row)
        return row
