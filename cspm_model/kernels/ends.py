"""Slopes of cable lengths and of the wrench over the places of the cables' two ends."""

import numpy as np
from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import (
    ARM,
    ATTACHMENT,
    COUPLE,
    DIRECTION,
    EXIT,
    LENGTH,
    PARTS,
    PULLEY_AXIS,
    PULLEY_RADIUS,
    ROUTE,
    SPAN_COLUMNS,
    cable_spans,
)
from cspm_model.kernels.pulley import pulley_turning
from cspm_model.kernels.rotation import (
    Placement,
    Vector,
    cross,
    rotate,
    rotate_back,
    rotation_from_euler,
)
from cspm_model.kernels.route import STOP_COUNT

Array = NDArray[float64]
# Of one instant: lengths' slopes, (n, 3) each, and wrenches' per newton, (n, 6, 3) each; the exits'
# first.
Slopes = tuple[Array, Array, Array, Array]
# Of a cable with a route slopes are central differences over twice this [m].
_STEP = 1e-5


@njit(cache=True, error_model="numpy", forceinline=True)
def _placed(pose: Array) -> Placement:
    """Return a body at rest at a pose x y z φ θ ψ."""
    still = (0.0, 0.0, 0.0)
    rotation = rotation_from_euler(pose[3], pose[4], pose[5])
    return (pose[0], pose[1], pose[2]), rotation, still, still


@njit(cache=True, error_model="numpy")
def _turning(row: Array, span: Array, frame: Placement, bar: Placement, motion: Vector) -> Vector:
    """Return by how much the pull, parts times u, turns per motion of the attachment [1/m]."""
    axis, turn, _, _ = frame
    ex, ey, ez = rotate(turn, row[EXIT], row[EXIT + 1], row[EXIT + 2])
    x = bar[0][0] + span[ARM] - axis[0] - ex
    y = bar[0][1] + span[ARM + 1] - axis[1] - ey
    z = bar[0][2] + span[ARM + 2] - axis[2] - ez
    parts, (mx, my, mz) = row[PARTS], motion
    if row[PULLEY_RADIUS] > 0.0:
        swivel = rotate(turn, row[PULLEY_AXIS], row[PULLEY_AXIS + 1], row[PULLEY_AXIS + 2])
        tx, ty, tz = pulley_turning((x, y, z), swivel, row[PULLEY_RADIUS], motion)
        return parts * tx, parts * ty, parts * tz
    squared = x * x + y * y + z * z
    # A winch without cable has no direction that could turn.
    share = parts / np.sqrt(squared) if squared > 0.0 else 0.0
    along = (x * mx + y * my + z * mz) / squared if squared > 0.0 else 0.0
    return share * (mx - along * x), share * (my - along * y), share * (mz - along * z)


@njit(cache=True, error_model="numpy")
def _cable_slopes(
    i: int, row: Array, span: Array, frame: Placement, bar: Placement, out: Slopes
) -> None:
    """Write the slopes of one cable, of which `row` has the parameters and `span` the line."""
    by_exit, by_attachment, exit_wrench, attachment_wrench = out
    pull = (span[DIRECTION], span[DIRECTION + 1], span[DIRECTION + 2])
    arm = (span[ARM], span[ARM + 1], span[ARM + 2])
    by_exit[i, 0], by_exit[i, 1], by_exit[i, 2] = rotate_back(
        frame[1], -pull[0], -pull[1], -pull[2]
    )
    by_attachment[i, 0], by_attachment[i, 1], by_attachment[i, 2] = rotate_back(bar[1], *pull)
    for axis, unit in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        back = rotate(frame[1], -unit[0], -unit[1], -unit[2])
        fx, fy, fz = _turning(row, span, frame, bar, back)
        wrench = exit_wrench[i, :, axis]
        wrench[0], wrench[1], wrench[2] = -fx, -fy, -fz
        wrench[3], wrench[4], wrench[5] = cross(*arm, -fx, -fy, -fz)
        there = rotate(bar[1], *unit)
        fx, fy, fz = _turning(row, span, frame, bar, there)
        wrench = attachment_wrench[i, :, axis]
        wrench[0], wrench[1], wrench[2] = -fx, -fy, -fz
        mx, my, mz = cross(*arm, -fx, -fy, -fz)
        # The pull itself acts at a longer arm.
        nx, ny, nz = cross(*there, -pull[0], -pull[1], -pull[2])
        wrench[3], wrench[4], wrench[5] = mx + nx, my + ny, mz + nz


@njit(cache=True, error_model="numpy")
def _route_slopes(
    i: int,
    cable: Array,
    first: int,
    frame: Placement,
    bar: Placement,
    lengths: Array,
    wrenches: Array,
) -> None:
    """Write one end's slopes of one cable with a route.

    `cable` is its row, (1, CABLE_COLUMNS), where `first` is the end's column.
    """
    ends = np.empty((2, SPAN_COLUMNS))
    for axis in range(3):
        place = cable[0, first + axis]
        for side in range(2):
            cable[0, first + axis] = place + (_STEP if side == 1 else -_STEP)
            cable_spans(cable, frame, bar, ends[side : side + 1])
        cable[0, first + axis] = place
        lengths[i, axis] = (ends[1, LENGTH] - ends[0, LENGTH]) / (2.0 * _STEP)
        before, after = _wrench(ends[0]), _wrench(ends[1])
        for d in range(6):
            wrenches[i, d, axis] = (after[d] - before[d]) / (2.0 * _STEP)


@njit(cache=True, error_model="numpy")
def _wrench(span: Array) -> tuple[float, float, float, float, float, float]:
    """Return force and moment about the bar's origin per newton of a cable."""
    x, y, z = span[DIRECTION], span[DIRECTION + 1], span[DIRECTION + 2]
    nx, ny, nz = cross(span[ARM], span[ARM + 1], span[ARM + 2], x, y, z)
    cx, cy, cz = span[COUPLE], span[COUPLE + 1], span[COUPLE + 2]
    return -x, -y, -z, -nx - cx, -ny - cy, -nz - cz


@njit(cache=True, error_model="numpy", nogil=True)
def end_slopes_along(cables: Array, bars: Array, frames: Array, out: Slopes) -> None:
    """Write the slopes at poses `bars` and `frames`, (k, 6) each.

    `cables` are parameter rows; `out` has a row per instant ahead of the axes of `Slopes`. What is
    NaN stays NaN.
    """
    spans = np.empty((cables.shape[0], SPAN_COLUMNS))
    for k in range(len(bars)):
        frame, bar = _placed(frames[k]), _placed(bars[k])
        cable_spans(cables, frame, bar, spans)
        here = (out[0][k], out[1][k], out[2][k], out[3][k])
        for i in range(cables.shape[0]):
            if cables[i, ROUTE + STOP_COUNT] > 0.0:
                cable = cables[i : i + 1].copy()
                _route_slopes(i, cable, EXIT, frame, bar, here[0], here[2])
                _route_slopes(i, cable, ATTACHMENT, frame, bar, here[1], here[3])
            else:
                _cable_slopes(i, cables[i], spans[i], frame, bar, here)
