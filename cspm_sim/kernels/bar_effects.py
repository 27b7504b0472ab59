"""Effects that put forces and moments on the bar."""

from typing import Any

from numba import njit, types
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.bar import GRAVITY, bar_acceleration
from cspm_model.kernels.cable import ARM, DIRECTION, EXIT, LENGTH, PARTS, TENSION
from cspm_model.kernels.native import caller_returning
from cspm_model.kernels.rotation import Placement, Vector, cross, rotate
from cspm_sim.kernels.hooks import ATTACHMENT, BAR, HOOK, PENDANT, first_effect, run_effects

Array = NDArray[float64]
Rows = NDArray[int64]

_VECTOR, _PLACE = types.float64[::1], types.UniTuple(types.float64, 3)
_PLACEMENT = types.Tuple((_PLACE, types.UniTuple(types.float64, 9), _PLACE, _PLACE))
_FORCES = types.UniTuple(_PLACE, 2)
call_effects_on_bar = caller_returning(_FORCES)

# What effects on the bar read and change: velocity of the bar frame's origin, world axes, and the
# wrench that the effect adds there, world axes; its position and Euler angles.
VELOCITY = 0
WRENCH = 6
POSE = 12
BAR_SIGNALS = 18
# What effects at an attachment read: cable direction, velocity of the attachment against the exit,
# world axes, length, tension, gravity, velocity of the exit; and the force on the bar at the
# attachment that they add to.
END_DIRECTION = 0
END_VELOCITY = 3
END_LENGTH = 6
END_TENSION = 7
END_GRAVITY = 8
END_FORCE = 9
END_EXIT_VELOCITY = 12
END_SIGNALS = 15
# What hangs on the bar reads, beside VELOCITY and WRENCH of the bar: acceleration of the bar
# frame's origin without it, and what a force there adds to that, row by row.
FREE_ACCELERATION = 12
MOBILITY = 15
PENDANT_GRAVITY = 24
PENDANT_SIGNALS = 25


@njit(cache=True, error_model="numpy", inline="always")
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(cache=True, error_model="numpy", _nrt=False)
def attachment_wrench(
    frame: Placement,
    body: Placement,
    gravity: float,
    cables: Array,
    effects: Rows,
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> tuple[Vector, Vector]:
    """Return force and moment about the bar frame's origin of the effects at the attachments."""
    _, fr, fv, fw = frame
    _, _, bv, bw = body
    fx = fy = fz = mx = my = mz = 0.0
    cursor = first_effect(ATTACHMENT, effects)
    for i in range(cables.shape[0]):
        ax, ay, az = rotate(fr, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2])
        bx, by, bz = spans[i, ARM], spans[i, ARM + 1], spans[i, ARM + 2]
        ex, ey, ez = cross(fw[0], fw[1], fw[2], ax, ay, az)
        wx, wy, wz = cross(bw[0], bw[1], bw[2], bx, by, bz)
        exit_velocity = _sum(fv, (ex, ey, ez))
        end_velocity = _sum(bv, (wx, wy, wz))
        for d in range(3):
            signals[END_EXIT_VELOCITY + d] = exit_velocity[d]
            signals[END_VELOCITY + d] = end_velocity[d] - exit_velocity[d]
            signals[END_DIRECTION + d] = spans[i, DIRECTION + d] / cables[i, PARTS]
            signals[END_FORCE + d] = 0.0
        signals[END_LENGTH] = spans[i, LENGTH]
        signals[END_TENSION] = spans[i, TENSION]
        signals[END_GRAVITY] = gravity
        cursor = run_effects(ATTACHMENT, i, cursor, effects, effect_parameters, signals, state, out)
        x, y, z = signals[END_FORCE], signals[END_FORCE + 1], signals[END_FORCE + 2]
        nx, ny, nz = cross(bx, by, bz, x, y, z)
        fx, fy, fz = fx + x, fy + y, fz + z
        mx, my, mz = mx + nx, my + ny, mz + nz
    return (fx, fy, fz), (mx, my, mz)


@njit(cache=True, error_model="numpy", _nrt=False)
def bar_wrench(
    velocity: Vector,
    rate: Vector,
    cursor: int,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> tuple[Vector, Vector]:
    """Return the wrench that effects on the bar add at its frame's origin, world axes.

    `cursor` is the row of the first of them.
    """
    for d in range(3):
        signals[VELOCITY + d] = velocity[d]
        signals[VELOCITY + 3 + d] = rate[d]
        signals[WRENCH + d] = 0.0
        signals[WRENCH + 3 + d] = 0.0
        signals[POSE + d] = state[d]
        signals[POSE + 3 + d] = state[3 + d]
    run_effects(BAR, 0, cursor, effects, effect_parameters, signals, state, out)
    w = WRENCH
    return (signals[w], signals[w + 1], signals[w + 2]), (
        signals[w + 3],
        signals[w + 4],
        signals[w + 5],
    )


@njit(cache=True, error_model="numpy", _nrt=False)
def pendant_wrench(
    bar: Array,
    body: Placement,
    rate: Vector,
    force: Vector,
    moment: Vector,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> tuple[Vector, Vector]:
    """Return the wrench of what hangs on the bar; `force` and `moment` are all else that acts."""
    _, rotation, velocity, world_rate = body
    free, _ = bar_acceleration(bar, rotation, rate, force, moment)
    fx, fy, fz = force
    along = (
        bar_acceleration(bar, rotation, rate, (fx + 1.0, fy, fz), moment)[0],
        bar_acceleration(bar, rotation, rate, (fx, fy + 1.0, fz), moment)[0],
        bar_acceleration(bar, rotation, rate, (fx, fy, fz + 1.0), moment)[0],
    )
    for d in range(3):
        signals[VELOCITY + d] = velocity[d]
        signals[VELOCITY + 3 + d] = world_rate[d]
        signals[WRENCH + d] = signals[WRENCH + 3 + d] = 0.0
        signals[FREE_ACCELERATION + d] = free[d]
        signals[MOBILITY + 3 * d] = along[0][d] - free[d]
        signals[MOBILITY + 3 * d + 1] = along[1][d] - free[d]
        signals[MOBILITY + 3 * d + 2] = along[2][d] - free[d]
    signals[PENDANT_GRAVITY] = bar[GRAVITY]
    cursor = first_effect(PENDANT, effects)
    run_effects(PENDANT, 0, cursor, effects, effect_parameters, signals, state, out)
    w = WRENCH
    return (signals[w], signals[w + 1], signals[w + 2]), (
        signals[w + 3],
        signals[w + 4],
        signals[w + 5],
    )


def on_bar_signature(cables: Any) -> Any:  # noqa: ANN401 - numba's types
    """Return the signature of `effects_on_bar` for rows of cables of a type."""
    rows, matrix = types.int64[:, ::1], types.float64[:, ::1]
    return _FORCES(
        *(_VECTOR, _PLACEMENT, _PLACEMENT, _PLACE, _PLACE, _VECTOR, cables, rows, matrix, cables),
        *(_VECTOR, _VECTOR),
    )


@njit(cache=True, error_model="numpy", _nrt=False)
def effects_on_bar(
    state: Array,
    frame: Placement,
    body: Placement,
    force: Vector,
    moment: Vector,
    bar: Array,
    cables: Array,
    effects: Rows,
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    out: Array,
) -> tuple[Vector, Vector]:
    """Return force and moment on the bar with all that effects add, world axes."""
    _, _, velocity, world_rate = body
    last = effects.shape[0] - 1
    if effects[last, HOOK] < ATTACHMENT:
        return force, moment
    cursor = last
    while cursor > 0 and effects[cursor - 1, HOOK] >= BAR:
        cursor -= 1
    if effects[cursor, HOOK] >= BAR:
        f, m = bar_wrench(
            velocity, world_rate, cursor, effects, effect_parameters, signals, state, out
        )
        force, moment = _sum(force, f), _sum(moment, m)
        cursor -= 1
    if cursor >= 0 and effects[cursor, HOOK] == ATTACHMENT:
        f, m = attachment_wrench(
            frame,
            body,
            bar[GRAVITY],
            cables,
            effects,
            effect_parameters,
            spans,
            signals,
            state,
            out,
        )
        force, moment = _sum(force, f), _sum(moment, m)
    if effects[last, HOOK] == PENDANT:
        rate = (state[9], state[10], state[11])
        f, m = pendant_wrench(
            bar, body, rate, force, moment, effects, effect_parameters, signals, state, out
        )
        force, moment = _sum(force, f), _sum(moment, m)
    return force, moment
