"""Grids of the bar's poses, those of the thesis among them."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.kinematics import rotation

Array = NDArray[np.float64]


class Grid(NamedTuple):
    """Poses with roll 0: each position with each orientation.

    Attributes:
        x: surge [m].
        y: sway [m].
        z: heave, down [m].
        pitch: [rad].
        yaw: [rad].
    """

    x: Array
    y: Array
    z: Array
    pitch: Array
    yaw: Array

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values per DOF."""
        return tuple(len(values) for values in self)

    @property
    def size(self) -> int:
        """How many poses."""
        return int(np.prod(self.shape))

    @property
    def positions(self) -> Array:
        """Return x y z of all positions, (P, 3), the last fastest."""
        return np.array(list(product(self.x, self.y, self.z)))

    @property
    def rotations(self) -> Array:
        """Return R_world_body of all orientations, (Q, 3, 3), yaw fastest."""
        angles = product(self.pitch, self.yaw)
        return np.array([rotation([0.0, 0.0, 0.0, 0.0, *pair]) for pair in angles])

    def every(self, step: int) -> Grid:
        """Return the grid of every `step`-th value of each DOF."""
        return Grid(*(values[::step] for values in self))


def steps(low: float, step: float, high: float) -> Array:
    """Return low:step:high as MATLAB counts them, without the round-off of the sums."""
    count = int((high - low) / step + 1e-9) + 1
    return np.round(low + step * np.arange(count), 12)


_PLACES = (steps(0.0, 0.025, 0.35), steps(0.0, 0.025, 0.35), steps(0.4, 0.2, 4.0))
# Algorithms 1 and 2 of the thesis: a quarter in surge and sway, by symmetry; its second of the
# rotations as well.
GRIDS = {
    "pseudo_inverse": Grid(*_PLACES, steps(-1.3, 0.04, 1.3), steps(-0.8, 0.02, 0.8)),
    "general": Grid(*_PLACES, steps(0.0, 0.04, 1.3), steps(0.0, 0.02, 0.8)),
}
