"""The force controllers as a compiled phase, while nothing is wrong."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.dither import add_dither
from cspm_control.controllers.force_controller import pi_torques
from cspm_control.phases.ahead_phase import WIDTH, bias_phase, feedforward_phases
from cspm_control.stages.force_stage import (
    CLIPPED_STEPS,
    LIMITED_STEPS,
    SLEWED_STEPS,
    STEPS,
    ForceStage,
    keep_tensions,
)
from cspm_model.kernels.native import caller_of, flags_at, integers_at, matrix_at, vector_at
from cspm_model.phase import DONE, LEAVE, PHASE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import (
    BAR_REFERENCE,
    FORCE_INTERNALS,
    FRAME_REFERENCE,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    WINCH_STATE,
)

Array = NDArray[np.float64]
Places = NDArray[np.int64]

call_phase = caller_of(PHASE)
_NO_PLACES = np.zeros(1, dtype=np.int64)

# Integers: columns in the row (-1: none), whether winches are released and torques slewed, the
# period [ns], whether there is a dither, and by address what corrects tensions and what computes
# torques ahead (0: nothing does).
WANTED, MEASURED, WINCHES, OUT, INTERNALS = range(5)
RELEASES, SLEWS, PERIOD, DITHERS, BAR, FRAME = range(5, 11)
BIAS, FIRST_AHEAD, SECOND_AHEAD, INTEGERS = range(11, 15)
# Where the places of these three are.
OF_BIAS, OF_FIRST, OF_SECOND = range(17, 20)


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    integers, counts, numbers = integers_at(places, 0), integers_at(places, 1), vector_at(places, 2)
    gains, terms, ahead = matrix_at(places, 3), matrix_at(places, 5), vector_at(places, 6)
    limits, integral = vector_at(places, 4), vector_at(places, 7)
    wanted, measured = vector_at(places, 8), vector_at(places, 20)
    clipped = take_inputs(row, integers, places)
    if clipped < 0:
        return LEAVE
    prepare(step, row, integers, places)
    n, first = wanted.shape[0], integers[OUT]
    out = row[first : first + n]
    period = numbers[0]
    limited = pi_torques(wanted, measured, ahead, gains, limits, period, integral, terms, out)
    if integers[DITHERS] != 0:
        amplitudes, frequencies = vector_at(places, 15), vector_at(places, 16)
        add_dither(step * integers[PERIOD], amplitudes, frequencies, limits, out)
    finish(row, integers, counts, places)
    counts[STEPS] += 1
    counts[LIMITED_STEPS] += limited > 0
    counts[CLIPPED_STEPS] += clipped
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def prepare(step: int, row: Array, integers: Places, places: Places) -> None:
    """Correct the measured tensions, and compute the torques ahead."""
    if integers[BIAS] != 0:
        call_phase(integers[BIAS], step, row, integers_at(places, OF_BIAS))
    if integers[FIRST_AHEAD] != 0:
        call_phase(integers[FIRST_AHEAD], step, row, integers_at(places, OF_FIRST))
    if integers[SECOND_AHEAD] != 0:
        call_phase(integers[SECOND_AHEAD], step, row, integers_at(places, OF_SECOND))


@njit(cache=True, error_model="numpy", inline="always")
def is_finite(row: Array, first: int) -> bool:
    """Return whether a reference's numbers are finite; true where there is none."""
    bad = 0
    for k in range(WIDTH if first >= 0 else 0):
        bad += not isfinite(row[first + k])
    return bad == 0


@njit(cache=True, error_model="numpy", inline="always")
def take_inputs(row: Array, integers: Places, places: Places) -> int:
    """Keep the tensions; return whether a wanted one was limited, −1 where Python has to look."""
    wanted, measured, released = vector_at(places, 8), vector_at(places, 9), flags_at(places, 13)
    n, first = wanted.shape[0], integers[WANTED]
    command = row[first : first + n]
    if integers[RELEASES] != 0:
        for i in range(n):
            if command[i] == 0.0 and not released[i]:
                return -1
    winches, first = integers[WINCHES], integers[MEASURED]
    state = row[winches : winches + 3 * n] if winches >= 0 else row[:0]
    found = row[first : first + n]
    if not (is_finite(row, integers[BAR]) and is_finite(row, integers[FRAME])):
        return -1
    limits, trip = matrix_at(places, 10), vector_at(places, 11)
    bad, clipped = keep_tensions(command, found, state, limits, trip, wanted, measured)
    return -1 if bad >= 0 else int(clipped)


@njit(cache=True, error_model="numpy", inline="always")
def finish(row: Array, integers: Places, counts: Places, places: Places) -> None:
    """Let released winches come to rest, slew the torques, and send the terms."""
    terms, torque, numbers = matrix_at(places, 5), vector_at(places, 12), vector_at(places, 2)
    released, damping = flags_at(places, 13), vector_at(places, 14)
    limits, n, first = vector_at(places, 4), torque.shape[0], integers[OUT]
    out = row[first : first + n]
    slewed = 0
    for i in range(n):
        if integers[RELEASES] != 0 and released[i]:
            speed = row[integers[WINCHES] + n + i] if integers[WINCHES] >= 0 else 0.0
            out[i] = min(limits[i], max(-limits[i], -damping[i] * speed))
        if integers[SLEWS] != 0:
            given = min(torque[i] + numbers[1], max(torque[i] - numbers[1], out[i]))
            if given != out[i]:
                slewed = 1
            out[i] = given
        torque[i] = out[i]
    counts[SLEWED_STEPS] += slewed
    if integers[INTERNALS] >= 0:
        for i in range(n):
            row[integers[INTERNALS] + i] = terms[0, i]
            row[integers[INTERNALS] + n + i] = terms[1, i]


def force_phase(stage: ForceStage, slots: Slots, period_ns: int) -> Phase:
    """Return the stage as a phase of a step of `period_ns` [ns]."""
    n, step, found = len(stage.wanted), stage.limits.torque_step, stage.controller
    ahead, damping = np.zeros(n), stage.release_damping
    corrected = stage.measured if stage.bias is None else np.zeros(n)
    before = [bias_phase(stage, slots, corrected), *feedforward_phases(stage, slots, ahead)]
    before += [None] * (3 - len(before))
    integers = _integers(stage, slots, period_ns)
    integers[BIAS : SECOND_AHEAD + 1] = [each.address if each else 0 for each in before]
    amplitudes, frequencies = np.zeros(n), np.zeros(n)
    if stage.dither is not None:
        amplitudes, frequencies, _ = stage.dither.arrays
    return make_phase(
        _kernel,
        *(integers, stage.counts, np.array([found.period, step or 0.0])),
        *(found.gains, found.torque_limits, found.terms, ahead, found.integral),
        *(stage.wanted, stage.measured, stage.tension_limits, stage.limits.trip, stage.torque),
        *(stage.released, np.zeros(n) if damping is None else damping),
        *(amplitudes, frequencies),
        *(each.places if each else _NO_PLACES for each in before),
        corrected,
        ready=lambda: stage.steady,
        parts=tuple(each for each in before if each),
    )


def _integers(stage: ForceStage, slots: Slots, period_ns: int) -> Places:
    """Return the integers without addresses."""
    integers = np.full(INTEGERS, -1, dtype=np.int64)
    integers[WANTED], integers[MEASURED] = slots.first(TENSION_COMMAND), slots.first(TENSION)
    integers[WINCHES], integers[OUT] = slots.first(WINCH_STATE), slots.first(TORQUE_COMMAND)
    integers[RELEASES] = stage.release_damping is not None
    integers[SLEWS] = stage.limits.torque_step is not None
    integers[PERIOD], integers[DITHERS] = period_ns, stage.dither is not None
    if stage.friction is not None or stage.winch is not None:
        integers[BAR], integers[FRAME] = slots.first(BAR_REFERENCE), slots.first(FRAME_REFERENCE)
    if stage.internals:
        integers[INTERNALS] = slots.first(FORCE_INTERNALS)
    return integers
