"""Cable lengths from poses, beside what encoders and the cables' weight make of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.cable_motion import cable_motion
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_model.kernels.cable import RADIUS
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

# Rows a second: lengths change slowly, and more rows of one motion say no more.
_RATE = 50.0


class LengthRows(NamedTuple):
    """One recording's cables at equal steps, all (k, n), without holes.

    Attributes:
        times: (k,) [s].
        lengths: from exit to attachment by the poses [m].
        rates: of these [m/s].
        wound: minus r/n·q, from an arbitrary zero [m].
        sag: horizontal share squared times length cubed [m³]: a cable of weight w per length under
            tension T is longer than its chord by w²/(24·T²) of it (parabola).
        starts: first rows of stretches without a hole.
    """

    times: Array
    lengths: Array
    rates: Array
    wound: Array
    sag: Array
    starts: tuple[int, ...]


def length_rows(measurement: Measurement) -> LengthRows:
    """Return what poses and encoders of a recording say of its cables' lengths.

    Raises:
        InputError: no cables, or a pose or the motor angles are missing.
    """
    machine, path = measurement.machine, measurement.path
    needed = {"/winches/state position": measurement.angle, "/bar/pose": measurement.bar_pose}
    if machine.bar is None:
        needed = {"a bar in the test-bed": None}
    elif machine.winch_frame is not None:
        needed["/winch_frame/pose"] = measurement.frame_pose
    missing = [name for name, found in needed.items() if found is None]
    if missing:
        raise InputError(
            f"{path}: lengths need {', '.join(missing)}, allowed: recordings with motor angles and"
            " the poses of what moves"
        )
    timeline = Timeline(measurement)
    parameters = nominal_parameters(machine)
    motion, angles = cable_motion(timeline, parameters), timeline.angles
    assert angles is not None
    rates = motion.bar_rates + motion.frame_rates
    step = max(1, round(1.0 / (_RATE * timeline.period)))
    whole = np.isfinite(np.hstack([motion.lengths, rates, angles])).all(axis=1)
    rows = np.flatnonzero(whole)[::step]
    if not len(rows):
        raise InputError(f"{path}: no instant with all poses and angles, allowed: some seconds")
    wound = -parameters.cables[:, RADIUS] * angles[rows]
    lengths, across = motion.lengths[rows], _horizontal(timeline, measurement)[rows]
    gaps = np.flatnonzero(np.diff(rows) > 2 * step) + 1
    return LengthRows(
        timeline.times[rows],
        lengths,
        rates[rows],
        wound,
        across**2 * lengths**3,
        (0, *gaps.tolist()),
    )


def _horizontal(timeline: Timeline, measurement: Measurement) -> Array:
    """Return the horizontal share of each cable's direction, (k, n)."""
    bars, frames = timeline.bar_poses, timeline.frame_poses
    columns = []
    for cable in measurement.machine.cables:
        far = bars[:, :3] + _turned(bars[:, 3:], np.array(cable.attachment))
        apart = far - frames[:, :3] - _turned(frames[:, 3:], np.array(cable.exit))
        columns.append(np.hypot(apart[:, 0], apart[:, 1]) / np.linalg.norm(apart, axis=1))
    return np.stack(columns, axis=1)


def _turned(angles: Array, point: Array) -> Array:
    """Return R = Rz(ψ)·Ry(θ)·Rx(φ) times a point, angles (k, 3) [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles).T, np.sin(angles).T
    x, y, z = point
    tilted = cp * x + sp * (sr * y + cr * z)
    across = cr * y - sr * z
    down = -sp * x + cp * (sr * y + cr * z)
    return np.stack([cy * tilted - sy * across, sy * tilted + cy * across, down], axis=1)
