"""Grids of the bar's poses: those of the thesis, and those of any machine's own box."""

from __future__ import annotations

from collections.abc import Sequence
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
# Which value of a pose each DOF of a grid is.
GRID_AXES = {"surge": 0, "sway": 1, "heave": 2, "pitch": 4, "yaw": 5}
# Values per DOF over a machine's own box.
PLACES, ANGLES = 21, steps(-0.8, 0.1, 0.8)
# A box lower than this share of its width is the ceiling of a machine whose bar hangs below it, as
# deep as the box is wide.
FLAT = 0.25
# The test-beds that reconstruct the thesis's machine, for which its grids are meant.
THESIS_MACHINES = ("thesis", "thesis_refitted", "thesis_six_dof", "thesis_target")
# Algorithms 1 and 2 of the thesis: a quarter in surge and sway, by symmetry; its second of the
# rotations as well.
GRIDS = {
    "pseudo_inverse": Grid(*_PLACES, steps(-1.3, 0.04, 1.3), steps(-0.8, 0.02, 0.8)),
    "general": Grid(*_PLACES, steps(0.0, 0.04, 1.3), steps(0.0, 0.02, 0.8)),
}


def workspace_grids(
    name: str, exits: Array, axes: Sequence[int], pose: Sequence[float]
) -> dict[str, Grid]:
    """Return the grid of each algorithm for a machine: the thesis's, or that of the box of exits.

    Args:
        name: of the machine.
        exits: of its cables, (n, 3) [m].
        axes: of the wrench that its cables give; DOFs that are not among them stay as in `pose`.
        pose: of the bar, x y z φ θ ψ [m, rad].
    """
    if name in THESIS_MACHINES:
        return GRIDS
    low, high = exits.min(axis=0), exits.max(axis=0)
    width = float((high - low)[:2].max())
    if high[2] - low[2] < FLAT * width:
        high[2] += width
    values = [np.linspace(low[i], high[i], PLACES) for i in range(3)] + [ANGLES, ANGLES]
    chosen = [
        each if axis in axes else np.array([float(pose[axis])])
        for each, axis in zip(values, GRID_AXES.values(), strict=True)
    ]
    return dict.fromkeys(GRIDS, Grid(*chosen))


def both_ways(values: Array) -> Array:
    """Return values from 0 on, mirrored; values that have a sign already as they are."""
    return values if values[0] < 0.0 or len(values) == 1 else np.r_[-values[:0:-1], values]
