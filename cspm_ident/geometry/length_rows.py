"""What poses, encoders and load cells say of cable lengths, at equal steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.cable_motion import CableMotion, cable_motion, damping_of
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_model.elastic_law import elongation_at
from cspm_model.kernels.cable import HAS_CABLE, OFFSET_LENGTH, RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import altered_testbed, read_actions

Array = NDArray[np.float64]

# Rows a second, and to what they are smoothed [Hz]: calibration moves slowly, and dampers make much
# tension of a quick pose's noise.
RATE = 50.0
_BAND = 5.0
_FEWEST = 50


class LengthRows(NamedTuple):
    """One recording's instants at which all is known.

    Attributes:
        cables: the described machine's parameter rows (n, columns).
        bars, frames: poses of bar and winch frame, (k, 6).
        rates: of the lengths by the poses, (k, n) [m/s].
        wound: cable that the drums took since the first row, by the described radii, unstretched,
            (k, n) [m].
        stretch: by the described law and the load cells, (k, n) [m]; 0 without load cells.
    """

    cables: Array
    bars: Array
    frames: Array
    rates: Array
    wound: Array
    stretch: Array


def length_rows(measurement: Measurement) -> LengthRows:
    """Return what a recording says of its cables' lengths.

    Raises:
        InputError: no bar, or a pose or the motor angles are missing.
    """
    _check(measurement)
    parameters = nominal_parameters(_as_it_acts(measurement))
    timeline = Timeline(measurement, pose_band=_BAND).slowly(round(1e9 / RATE), _BAND)
    motion, angles = cable_motion(timeline, parameters), timeline.angles
    assert angles is not None
    rates = motion.bar_rates + motion.frame_rates
    stretch = _stretch(timeline, parameters, motion)
    drums = parameters.cables[:, RADIUS] * parameters.cables[:, HAS_CABLE]
    turned = drums * np.diff(angles, axis=0)
    share = np.nan_to_num(stretch / motion.lengths)
    # The winch winds stretched cable, thesis (2-16..2-18).
    taken = np.nan_to_num(turned * (1.0 - 0.5 * (share[1:] + share[:-1])))
    wound = np.vstack([np.zeros(turned.shape[1]), np.cumsum(taken, axis=0)])
    whole = np.isfinite(np.hstack([motion.lengths, rates, angles, stretch])).all(axis=1)
    rows = np.flatnonzero(whole)
    if len(rows) < _FEWEST:
        raise InputError(
            f"{measurement.path}: {len(rows)} rows with all poses and angles, allowed: {_FEWEST}"
            f" and more, of which there are {RATE:g} a second"
        )
    kept = (timeline.bar_poses, timeline.frame_poses, rates, wound, stretch)
    return LengthRows(parameters.cables, *(np.ascontiguousarray(each[rows]) for each in kept))


def _as_it_acts(measurement: Measurement) -> Testbed:
    """Return the machine with the numbers that its file's effects change."""
    return altered_testbed(measurement.machine, read_actions(measurement.machine))


def _check(measurement: Measurement) -> None:
    machine = measurement.machine
    needed = {"/winches/state position": measurement.angle, "/bar/pose": measurement.bar_pose}
    if machine.bar is None:
        needed = {"a bar in the test-bed": None}
    elif machine.winch_frame is not None and not measurement.knows_frame:
        needed["/winch_frame/pose"] = None
    missing = [name for name, found in needed.items() if found is None]
    if missing:
        raise InputError(
            f"{measurement.path}: geometry needs {', '.join(missing)}, allowed: recordings with"
            " motor angles and the poses of what moves"
        )


def _stretch(timeline: Timeline, parameters: PlantParameters, motion: CableMotion) -> Array:
    """Return elongations by the law, of the tensions less what the damper carries, (k, n) [m]."""
    tensions, speeds = timeline.smooth_tensions, timeline.speeds
    if tensions is None or speeds is None:
        return np.zeros_like(motion.lengths)
    wound_rates = parameters.cables[:, RADIUS] * speeds
    damper = damping_of(parameters, motion.lengths) * (
        motion.bar_rates + motion.frame_rates + wound_rates
    )
    known = np.isfinite(tensions) & np.isfinite(motion.lengths)
    pull = np.where(known, tensions - damper, 0.0)
    lengths = np.where(known, motion.lengths, 1.0) + parameters.cables[:, OFFSET_LENGTH]
    first = elongation_at(parameters, pull, lengths)
    return np.asarray(np.where(known, elongation_at(parameters, pull, lengths - first), np.nan))
