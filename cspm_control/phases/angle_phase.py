"""Prescribed motor angles as a compiled phase, while nothing is wrong."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.angle_servo import path_angles, servo_torques
from cspm_control.stages.angle_stage import AngleStage
from cspm_model.kernels.native import integers_at, matrix_at, vector_at
from cspm_model.phase import DONE, LEAVE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import TENSION, TORQUE_COMMAND, WINCH_STATE

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# Integers: columns in the row (tensions −1: none), and the period [ns].
WINCHES, MEASURED, OUT, PERIOD = range(4)


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    integers, counts = integers_at(places, 0), integers_at(places, 1)
    first, tensions, trip = vector_at(places, 2), vector_at(places, 3), vector_at(places, 4)
    wanted, rates = vector_at(places, 5), vector_at(places, 6)
    n, begin, out = first.shape[0], integers[WINCHES], integers[OUT]
    if not _is_good(row, begin, integers[MEASURED], trip):
        return LEAVE
    if integers[MEASURED] >= 0:
        for i in range(n):
            tensions[i] = row[integers[MEASURED] + i]
    starts, times, angles = integers_at(places, 7), vector_at(places, 8), vector_at(places, 9)
    path_angles(step * integers[PERIOD] * 1e-9, starts, times, angles, wanted, rates)
    for i in range(n):
        wanted[i] += first[i]
    limited = servo_torques(
        wanted,
        rates,
        row[begin : begin + n],
        row[begin + n : begin + 2 * n],
        matrix_at(places, 10),
        vector_at(places, 11),
        vector_at(places, 13)[0],
        vector_at(places, 12),
        row[out : out + n],
    )
    counts[0] += 1
    counts[1] += limited > 0
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def _is_good(row: Array, winches: int, measured: int, trip: Array) -> bool:
    """Return whether all numbers are finite and no tension trips."""
    bad, n = 0, trip.shape[0]
    for i in range(3 * n):
        bad += not isfinite(row[winches + i])
    for i in range(n if measured >= 0 else 0):
        tension = row[measured + i]
        bad += not (-inf < tension <= trip[i])
    return bad == 0


def angle_phase(stage: AngleStage, slots: Slots, period_ns: int) -> Phase:
    """Return the stage as a phase of a step of `period_ns` [ns], for paths that begin at 0."""
    columns = [slots.first(name) for name in (WINCH_STATE, TENSION, TORQUE_COMMAND)]
    integers, servo = np.array([*columns, period_ns], dtype=np.int64), stage.servo
    n = len(stage.first)
    return make_phase(
        _kernel,
        *(integers, stage.counts, stage.first, stage.tensions, stage.trip_tensions),
        *(np.zeros(n), np.zeros(n), *stage.generator.arrays),
        *(servo.gains, servo.torque_limits, servo.integral, np.array([servo.period])),
        ready=lambda: stage.steady,
    )
