"""The motion controllers as compiled phases: PID, state feedback and computed wrench."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.tension_distribution import DISTRIBUTE, distribute
from cspm_control.controllers.bar_dynamics import wanted_motion
from cspm_control.controllers.computed_wrench import (
    EXPECT,
    STARTED,
    WANTED_WRENCH,
    ComputedWrench,
    adapt_mass,
    expect,
    is_new,
    wanted_wrench,
)
from cspm_control.controllers.motion_controller import MotionController, add_weight, pid
from cspm_control.controllers.state_feedback import StateFeedback, add_inverse_dynamics
from cspm_control.phases.distribution_phase import (
    UNMOVED,
    call_distribute,
    distribution_arrays,
    pose_in,
)
from cspm_control.stages.motion_stage import MotionStage
from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.native import (
    address_of,
    caller_of,
    columns_at,
    fixed_matrix_at,
    integers_at,
    matrix_at,
    vector_at,
)
from cspm_model.phase import DONE, LEAVE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import BAR_POSE, BAR_REFERENCE, FRAME_POSE, MOTION_INTERNALS, WRENCH

Array = NDArray[np.float64]
Places = NDArray[np.int64]

call_wanted_wrench, call_expect = caller_of(WANTED_WRENCH), caller_of(EXPECT)

# Integers: columns in the row, −1 for none; of the computed wrench also the period [ns], the start
# [ns], whether a deviation is planned and periodic, if the mass is adapted, and addresses.
POSE, REFERENCE, OUT, INTERNALS, FRAME = range(5)
PERIOD_NS, START_NS, PLANNED, PERIODIC, ADAPTED = range(5, 10)
DISTRIBUTE_AT, METHOD_AT, WANTED_AT, EXPECT_AT, INTEGERS = range(10, 15)


@njit(cache=True, error_model="numpy", _nrt=False)
def _pid_kernel(step: int, row: Array, places: Places) -> int:
    pose, _, out = _feedback(row, places)
    add_weight(pose, vector_at(places, 4)[2], vector_at(places, 5), out)
    return DONE


@njit(cache=True, error_model="numpy", _nrt=False)
def _feedback_kernel(step: int, row: Array, places: Places) -> int:
    pose, reference, out = _feedback(row, places)
    add_inverse_dynamics(pose, reference, vector_at(places, 5), matrix_at(places, 6), out)
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def _feedback(row: Array, places: Places) -> tuple[Array, Array, Array]:
    """Write the PID terms, and return where pose, reference and wrench are."""
    integers, gains, memory = integers_at(places, 0), matrix_at(places, 1), matrix_at(places, 2)
    # Numbers: period, the derivative's pole, and the bar's weight.
    numbers, internals = vector_at(places, 4), integers[INTERNALS]
    pose = row[integers[POSE] : integers[POSE] + 7]
    reference = row[integers[REFERENCE] : integers[REFERENCE] + 19]
    out = row[integers[OUT] : integers[OUT] + 6]
    limits = vector_at(places, 3)
    pid(pose, reference, gains, limits, numbers[0], numbers[1], True, 0.0, memory, out)
    if internals >= 0:
        for d in range(6):
            row[internals + d] = memory[2, d]
            row[internals + 6 + d] = gains[d, 0] * memory[2, d]
            row[internals + 12 + d] = memory[0, d]
            row[internals + 18 + d] = gains[d, 2] * memory[1, d]
    return pose, reference, out


@njit(cache=True, error_model="numpy", _nrt=False)
def _computed_kernel(step: int, row: Array, places: Places) -> int:
    integers, counts, numbers = integers_at(places, 0), integers_at(places, 1), vector_at(places, 2)
    wanted, bar, memory = matrix_at(places, 3), vector_at(places, 4), matrix_at(places, 5)
    gains, known = matrix_at(places, 6), vector_at(places, 7)
    pose = row[integers[POSE] : integers[POSE] + 7]
    out = row[integers[OUT] : integers[OUT] + 6]
    frame = pose_in(row, integers[FRAME], vector_at(places, 8))
    _want(step, row, integers, places, wanted)
    fresh = is_new(pose, vector_at(places, 9), counts)
    call_wanted_wrench(
        integers[WANTED_AT],
        pose,
        fresh,
        wanted,
        bar,
        gains,
        vector_at(places, 10),
        numbers[0],
        numbers[1],
        counts[STARTED] != 0,
        memory,
        out,
    )
    counts[STARTED] = 1
    for d in range(6):
        out[d] -= known[d]
    if _distribute(integers, places, out, pose, frame) < 0:
        return LEAVE
    tensions, cables = matrix_at(places, 19), columns_at(places, 13)
    call_expect(integers[EXPECT_AT], pose, frame, wanted, tensions[1], cables, bar, known, memory)
    if integers[ADAPTED] != 0:
        mass = vector_at(places, 21), integers_at(places, 22)
        adapt_mass(wanted, bar, memory, *mass, vector_at(places, 23), matrix_at(places, 24))
    _send_terms(row, integers[INTERNALS], gains, memory)
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def _want(step: int, row: Array, integers: Places, places: Places, wanted: Array) -> None:
    """Write the motion wanted: the reference's, and what is planned beside it."""
    wanted_motion(row[integers[REFERENCE] : integers[REFERENCE] + 19], wanted)
    if integers[PLANNED] != 0:
        numbers, deviation = vector_at(places, 2), vector_at(places, 11)
        time = 1e-9 * (step * integers[PERIOD_NS] - integers[START_NS])
        periodic = integers[PERIODIC] != 0
        evaluate_motion(time, fixed_matrix_at(places, 12), numbers[2], periodic, deviation)
        for order in range(3):
            for d in range(6):
                wanted[order, d] += deviation[6 * order + d]


@njit(cache=True, error_model="numpy", inline="always")
def _distribute(integers: Places, places: Places, wrench: Array, bar: Array, frame: Array) -> int:
    return call_distribute(
        integers[DISTRIBUTE_AT],
        integers[METHOD_AT],
        wrench,
        bar,
        frame,
        columns_at(places, 13),
        integers_at(places, 14),
        matrix_at(places, 15),
        vector_at(places, 16),
        matrix_at(places, 17),
        vector_at(places, 18),
        vector_at(places, 25),
        matrix_at(places, 19),
        vector_at(places, 20),
    )


@njit(cache=True, error_model="numpy", inline="always")
def _send_terms(row: Array, first: int, gains: Array, memory: Array) -> None:
    if first >= 0:
        for d in range(6):
            fed_back = 1.0 if gains[d, 0] > 0.0 else 0.0
            row[first + d] = memory[0, d]
            row[first + 6 + d] = gains[d, 0] * memory[0, d]
            row[first + 12 + d] = memory[2, d] * fed_back
            row[first + 18 + d] = gains[d, 1] * memory[1, d]


def motion_phase(stage: MotionStage, slots: Slots, period_ns: int) -> Phase | None:
    """Return the stage as a phase of a step of `period_ns` [ns], None where Python computes."""
    integers = np.full(INTEGERS, -1, dtype=np.int64)
    integers[POSE], integers[OUT] = slots.first(BAR_POSE), slots.first(WRENCH)
    integers[REFERENCE] = slots.first(BAR_REFERENCE)
    integers[FRAME], integers[PERIOD_NS] = slots.first(FRAME_POSE), period_ns
    if stage.internals:
        integers[INTERNALS] = slots.first(MOTION_INTERNALS)
    if isinstance(stage.controller, MotionController):
        return _pid_phase(stage, stage.controller, integers)
    return _computed_phase(stage, stage.controller, integers)


def _pid_phase(stage: MotionStage, found: MotionController, integers: Places) -> Phase:
    numbers = np.array([found.period, found.filter, found.weight])
    kernel = _pid_kernel
    carried: tuple[Array, ...] = (found.com,)
    if isinstance(found, StateFeedback):
        kernel, carried = _feedback_kernel, (found.bar, found.scratch)
    return make_phase(
        kernel,
        integers,
        found.gains,
        found.memory,
        found.limits,
        numbers,
        *carried,
        ready=lambda: found.steady and not stage.suspended,
    )


def _computed_phase(stage: MotionStage, found: ComputedWrench, integers: Places) -> Phase | None:
    method, plan, mass = found.distribution.address, stage.deviation, found.mass
    if method is None:
        return None
    integers[DISTRIBUTE_AT], integers[METHOD_AT] = address_of(distribute, DISTRIBUTE), method
    integers[WANTED_AT] = address_of(wanted_wrench, WANTED_WRENCH)
    integers[EXPECT_AT] = address_of(expect, EXPECT)
    integers[START_NS], integers[PLANNED] = stage.start_ns, plan is not None
    integers[PERIODIC] = plan is not None and plan.periodic
    integers[ADAPTED] = mass is not None
    none = np.zeros((1, 1)), np.zeros(1, dtype=np.int64)
    spacing, knots = (1.0, none[0]) if plan is None else (plan.spacing, plan.knots)
    return make_phase(
        _computed_kernel,
        *(integers, found.counts, np.array([found.period, found.pose_age, spacing])),
        *(found.wanted, found.bar, found.memory, found.gains, found.known_wrench),
        *(np.array(UNMOVED), found.last_pose, found.observer, np.zeros(18), knots),
        *distribution_arrays(found.distribution),
        *((none[0][0], none[1], none[0][0], none[0]) if mass is None else mass.arrays),
        found.distribution.memory,
        ready=lambda: not stage.suspended,
    )
