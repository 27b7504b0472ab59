"""The simulated machine's phases of a step: it is observed, measured, and advances.

Their signature is `cspm_model.phase.PHASE`; their arrays are listed where they are made, in
`cspm_sim.plant`, `cspm_sim.truth` and `cspm_sim.sensor_phases`.
"""

from math import pi

from numba import njit, types
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.native import (
    caller_of,
    columns_at,
    cube_at,
    fixed_matrix_at,
    integer_matrix_at,
    integers_at,
    matrix_at,
    vector_at,
)
from cspm_model.kernels.rows import bar_twist_row, corrupt, motion_twist_row, pose_row
from cspm_model.phase import DONE, LEAVE, LOOK
from cspm_sim.kernels.plant import Scratch

Array = NDArray[float64]
Places = NDArray[int64]

_VECTOR, _MATRIX, _COLUMNS = types.float64[::1], types.float64[:, ::1], types.float64[::1, :]
_EFFECTS = types.int64[:, ::1]
_PARAMETERS = types.NamedTuple(
    [_VECTOR, _COLUMNS, types.float64[:, :, ::1], _EFFECTS, _MATRIX], PlantParameters
)
_SCRATCH = types.NamedTuple([_MATRIX, _COLUMNS, _VECTOR], Scratch)
# Of `plant_advance`; knots may not be written.
ADVANCE = types.int64(
    _VECTOR,
    _VECTOR,
    types.Array(types.float64, 2, "C", readonly=True),
    *(types.float64, types.boolean, types.int64, types.int64, types.boolean, types.float64),
    _PARAMETERS,
    _MATRIX,
    _SCRATCH,
    _MATRIX,
)
# Of `reported_torques`.
REPORT = types.void(
    *(_VECTOR, _VECTOR, types.int64, _COLUMNS, _EFFECTS, _MATRIX, _VECTOR, _VECTOR, _VECTOR)
)
call_advance, call_report = caller_of(ADVANCE), caller_of(REPORT)

# Integers of `advance_phase`: where the torques are in the row, whether the brakes are set, at
# which step a cable parts, which state is not finite (-1: none), whether the frame's motion is
# periodic, whether the bar is to stay upright, the address of `plant_advance`, and how many steps
# of the integration a period has.
TORQUE, LOCKED, NEXT_CUT, BAD, PERIODIC, UPRIGHT, ADDRESS, SUBSTEPS, ADVANCE_INTEGERS = range(9)


@njit(cache=True, error_model="numpy", _nrt=False)
def advance_phase(step: int, row: Array, places: Places) -> int:
    """Move the plant by one period with the torques in the row held."""
    integers, numbers = integers_at(places, 0), vector_at(places, 1)
    if step + 1 == integers[NEXT_CUT]:
        return LEAVE
    state, frame, frames, outputs = (
        vector_at(places, 2),
        vector_at(places, 3),
        matrix_at(places, 4),
        matrix_at(places, 5),
    )
    parameters = PlantParameters(
        vector_at(places, 7),
        columns_at(places, 8),
        cube_at(places, 9),
        integer_matrix_at(places, 10),
        matrix_at(places, 11),
    )
    scratch = Scratch(matrix_at(places, 12), columns_at(places, 13), vector_at(places, 14))
    first, substeps = integers[TORQUE], integers[SUBSTEPS]
    integers[BAD] = call_advance(
        integers[ADDRESS],
        state,
        row[first : first + outputs.shape[1]],
        fixed_matrix_at(places, 6),
        numbers[0],
        integers[PERIODIC] != 0,
        step * substeps,
        substeps,
        integers[LOCKED] != 0,
        numbers[1],
        parameters,
        frames,
        scratch,
        outputs,
    )
    for d in range(frame.shape[0]):
        frame[d] = frames[0, d]
    if integers[BAD] >= 0:
        return LOOK
    if parameters.bar.shape[0] > 0:
        turned = integers[UPRIGHT] != 0 and abs(state[3]) > pi
        if turned or abs(state[4]) > 0.5 * pi:
            return LOOK
    return DONE


# Integers of `truth_phase`: the first column of torques and of each signal in the row (-1: not
# there), whether drives act, how many of the bar's states there are, the plant's period [ns], and
# the address of `reported_torques`.
COMMAND, DRIVES, STATES, PERIOD_NS, REPORT_ADDRESS, TARGET_PERIODIC = range(6)
FRAME_POSE, FRAME_TWIST, BAR_POSE, BAR_TWIST, TARGET_POSE, TARGET_TWIST = range(6, 12)
WINCHES, TENSION, UNSTRETCHED, BAR, TRUTH_INTEGERS = range(12, 17)
# What is counted, as integers: whether any cable is slack, at how many of how many steps any was,
# and when last none was [ns].
SLACK, SLACK_STEPS, STEPS, LAST_TAUT_NS, COUNTS = range(5)


@njit(cache=True, error_model="numpy", inline="always")
def _copy(values: Array, first: int, row: Array) -> None:
    if first >= 0:
        for i in range(values.shape[0]):
            row[first + i] = values[i]


@njit(cache=True, error_model="numpy", _nrt=False)
def truth_phase(step: int, row: Array, places: Places) -> int:
    """Bring the true quantities up to date, and into the row."""
    integers, counts = integers_at(places, 0), integers_at(places, 1)
    state, frame, tensions = vector_at(places, 2), vector_at(places, 3), matrix_at(places, 4)[0]
    frame_pose, frame_twist = vector_at(places, 5), vector_at(places, 6)
    bar_pose, bar_twist = vector_at(places, 7), vector_at(places, 8)
    winches = matrix_at(places, 9)
    n, first = tensions.shape[0], integers[STATES]
    if integers[FRAME_POSE] >= 0:
        pose_row(frame, frame_pose)
        motion_twist_row(frame, frame_twist)
        _copy(frame_pose, integers[FRAME_POSE], row)
        _copy(frame_twist, integers[FRAME_TWIST], row)
    if integers[BAR_POSE] >= 0:
        pose_row(state, bar_pose)
        bar_twist_row(state, bar_twist)
        _copy(bar_pose, integers[BAR_POSE], row)
        _copy(bar_twist, integers[BAR_TWIST], row)
        _copy(state[:6], integers[BAR], row)
    if integers[TARGET_POSE] >= 0:
        _target(step, row, places, integers)
    _winches(row, places, integers, state, winches)
    _copy(winches[0], integers[WINCHES], row)
    _copy(winches[1], integers[WINCHES] + n, row)
    _copy(winches[2], integers[WINCHES] + 2 * n, row)
    _copy(tensions, integers[TENSION], row)
    _copy(state[first : first + n], integers[UNSTRETCHED], row)
    _count(step * integers[PERIOD_NS], tensions, vector_at(places, 10), counts)
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def _target(step: int, row: Array, places: Places, integers: Places) -> None:
    motion, pose, twist = vector_at(places, 17), vector_at(places, 18), vector_at(places, 19)
    time, spacing = step * integers[PERIOD_NS] * 1e-9, vector_at(places, 21)[0]
    periodic = integers[TARGET_PERIODIC] != 0
    evaluate_motion(time, fixed_matrix_at(places, 20), spacing, periodic, motion)
    pose_row(motion, pose)
    motion_twist_row(motion, twist)
    _copy(pose, integers[TARGET_POSE], row)
    _copy(twist, integers[TARGET_TWIST], row)


@njit(cache=True, error_model="numpy", inline="always")
def _winches(row: Array, places: Places, integers: Places, state: Array, winches: Array) -> None:
    """Write angles, speeds, and the torques that the drives report for those in the row."""
    n, first, command = winches.shape[1], integers[STATES], integers[COMMAND]
    limits, applied = vector_at(places, 11), winches[2]
    for i in range(n):
        winches[0, i] = state[first + n + i]
        winches[1, i] = state[first + 2 * n + i]
        torque = row[command + i]
        # A torque that is no number stays none.
        if torque > limits[i]:
            torque = limits[i]
        elif torque < -limits[i]:
            torque = -limits[i]
        applied[i] = torque
    if integers[DRIVES] != 0:
        call_report(
            integers[REPORT_ADDRESS],
            state,
            row[command : command + n],
            first,
            columns_at(places, 12),
            integer_matrix_at(places, 13),
            matrix_at(places, 14),
            vector_at(places, 15),
            matrix_at(places, 16)[0],
            applied,
        )


@njit(cache=True, error_model="numpy", inline="always")
def _count(now_ns: int, tensions: Array, limits: Array, counts: Places) -> None:
    counts[SLACK] = 0
    for i in range(tensions.shape[0]):
        if tensions[i] <= limits[i]:
            counts[SLACK] = 1
    counts[SLACK_STEPS] += counts[SLACK]
    counts[STEPS] += 1
    if counts[SLACK] == 0:
        counts[LAST_TAUT_NS] = now_ns


# Integers of the sensors' phases: the next row of noise, whether it measures a pose, and the first
# column of what arrives.
NOISE, IS_POSE, COLUMN, SENSOR_INTEGERS = range(4)


@njit(cache=True, error_model="numpy", _nrt=False)
def sample_phase(step: int, row: Array, places: Places) -> int:
    """Take a sample, into the next row of those underway."""
    integers, counts = integers_at(places, 0), integers_at(places, 1)
    noise, underway, measured = matrix_at(places, 3), matrix_at(places, 6), vector_at(places, 7)
    slot = counts[0] % underway.shape[0]
    deviation, resolution = vector_at(places, 4), vector_at(places, 5)
    corrupt(vector_at(places, 2), noise[integers[NOISE]], deviation, resolution, measured)
    if integers[IS_POSE] != 0:
        pose_row(measured, underway[slot])
    else:
        _copy(measured, 0, underway[slot])
    integers[NOISE] += 1
    counts[0] += 1
    return DONE


@njit(cache=True, error_model="numpy", _nrt=False)
def arrival_phase(step: int, row: Array, places: Places) -> int:
    """Let the oldest sample underway arrive, into the row."""
    integers, counts = integers_at(places, 0), integers_at(places, 1)
    underway = matrix_at(places, 6)
    _copy(underway[counts[1] % underway.shape[0]], integers[COLUMN], row)
    counts[1] += 1
    return DONE
