"""How lengths and wrench change with the places of the cables' ends, along a motion.

An exit is a point of winch_frame_ned and an attachment one of bar_ned. The length's slopes follow
from thesis (2-2), the wrench's from w = −Jᵀt of (2-13) at constant tensions. Over a pulley the exit
takes the pulley with it and leaves its swivelling axis as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels.ends import end_slopes_along
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


class EndSlopes(NamedTuple):
    """Slopes over exit x y z in winch frame axes, or attachment x y z in bar axes.

    Attributes:
        exit_lengths: of each cable's own length, (k, n, 3) [1].
        attachment_lengths: likewise.
        exit_wrenches: of the wrench on the bar about its origin in world axes, per newton of the
            cable's tension, (k, n, 6, 3) [1/m, 1].
        attachment_wrenches: likewise.
    """

    exit_lengths: Array
    attachment_lengths: Array
    exit_wrenches: Array
    attachment_wrenches: Array


def end_slopes(cables: Array, bar_poses: ArrayLike, frame_poses: ArrayLike) -> EndSlopes:
    """Return the slopes at each instant of a motion; zeros for a winch without cable.

    Args:
        cables: parameter rows (n, columns), see `kernels.cable`.
        bar_poses: x y z φ θ ψ, (k, 6) [m, rad]; where one is not known, NaN.
        frame_poses: of the winch frame, likewise.

    Raises:
        InputError: poses of another shape.
    """
    bars, frames = (np.ascontiguousarray(each, dtype=float) for each in (bar_poses, frame_poses))
    if bars.ndim != 2 or bars.shape[1] != 6 or frames.shape != bars.shape:
        raise InputError(
            f"end slopes: poses of shapes {bars.shape} and {frames.shape}, allowed: both (k, 6)"
        )
    steps, n = len(bars), len(cables)
    out = EndSlopes(*(np.empty((steps, n, *tail)) for tail in ((3,), (3,), (6, 3), (6, 3))))
    end_slopes_along(cables, bars, frames, tuple(out))
    return out
