"""Cable lengths and the structure matrix of all cables at once."""

import numpy as np
from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import (
    ARM,
    COUPLE,
    DIRECTION,
    EXIT,
    LENGTH,
    PULLEY_RADIUS,
    ROUTE,
    SPAN_COLUMNS,
    cable_spans,
)
from cspm_model.kernels.rotation import cross, rotate, rotation_from_euler
from cspm_model.kernels.route import STOP_COUNT

Array = NDArray[float64]


@njit(cache=True, error_model="numpy")
def cable_geometry(
    cables: Array, bar_pose: Array, frame_pose: Array, lengths: Array, bar: Array, frame: Array
) -> None:
    """Write lengths (n,) and the rows of l̇ = bar·twist_bar + frame·twist_frame, each (n, 6).

    `cables` are parameter rows (see `kernels.cable`), poses x y z φ θ ψ, twists in world axes.
    """
    still = (0.0, 0.0, 0.0)
    body_rotation = rotation_from_euler(bar_pose[3], bar_pose[4], bar_pose[5])
    body = ((bar_pose[0], bar_pose[1], bar_pose[2]), body_rotation, still, still)
    base_rotation = rotation_from_euler(frame_pose[3], frame_pose[4], frame_pose[5])
    base = ((frame_pose[0], frame_pose[1], frame_pose[2]), base_rotation, still, still)
    spans = np.empty((cables.shape[0], SPAN_COLUMNS))
    cable_spans(cables, base, body, spans)
    for i in range(cables.shape[0]):
        ux, uy, uz = spans[i, DIRECTION], spans[i, DIRECTION + 1], spans[i, DIRECTION + 2]
        bx, by, bz = spans[i, ARM], spans[i, ARM + 1], spans[i, ARM + 2]
        ax, ay, az = rotate(
            base_rotation, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2]
        )
        if cables[i, PULLEY_RADIUS] > 0.0 or cables[i, ROUTE + STOP_COUNT] > 0.0:
            # The cable's line meets the attachment, not the exit.
            ax, ay, az = (
                bar_pose[0] + bx - frame_pose[0],
                bar_pose[1] + by - frame_pose[1],
                bar_pose[2] + bz - frame_pose[2],
            )
        lengths[i] = spans[i, LENGTH]
        bar[i, 0], bar[i, 1], bar[i, 2] = ux, uy, uz
        cx, cy, cz = spans[i, COUPLE], spans[i, COUPLE + 1], spans[i, COUPLE + 2]
        tx, ty, tz = cross(bx, by, bz, ux, uy, uz)
        bar[i, 3], bar[i, 4], bar[i, 5] = tx + cx, ty + cy, tz + cz
        frame[i, 0], frame[i, 1], frame[i, 2] = -ux, -uy, -uz
        mx, my, mz = cross(ax, ay, az, ux, uy, uz)
        frame[i, 3], frame[i, 4], frame[i, 5] = -mx - cx, -my - cy, -mz - cz
