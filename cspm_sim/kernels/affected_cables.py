"""Cables and winches with effects on cables, drives or the winch frame.

Without effects it gives bit for bit what the shorter way in `kernels.plant` gives.
"""

from math import sqrt
from typing import Any

from numba import njit, types
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.cable import (
    DAMPING_CONSTANT,
    DAMPING_SLOPE,
    DIRECTION,
    FLOOR_TENSION,
    GEAR_RATIO,
    GRAVITY_HERE,
    HAS_CABLE,
    LENGTH,
    OFFSET_LENGTH,
    PARTS,
    RADIUS,
    RATE,
    TENSION,
    cable_spans,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.native import caller_returning
from cspm_model.kernels.rotation import Placement
from cspm_sim.kernels.hooks import (
    CABLE,
    DRIVE,
    FRAME,
    LOADED_CABLE,
    LOADED_FRAME,
    WINCH,
    first_effect,
    run_effects,
)
from cspm_sim.kernels.winch import (
    REPORTED_TORQUE,
    RESISTANCE,
    fill_winch_signals,
    winch_acceleration,
)

Array = NDArray[float64]
Rows = NDArray[int64]

_VECTOR, _PLACE = types.float64[::1], types.UniTuple(types.float64, 3)
_PLACEMENT = types.Tuple((_PLACE, types.UniTuple(types.float64, 9), _PLACE, _PLACE))
call_affected_cables = caller_returning(_PLACEMENT)

# What effects on a cable read.
SPAN_LENGTH = 0  # from exit to attachment [m]
SPAN_RATE = 1
UNSTRETCHED = 2  # [m]
MOTOR_ANGLE = 3
MOTOR_SPEED = 4
WOUND_RADIUS = 5  # cable wound per radian of the motor [m]
DRUM_GEAR = 6
HORIZONTAL = 7  # horizontal share of the cable's direction
DOWNWARD = 8  # its share downwards, from exit to attachment
CABLE_GRAVITY = 9
CABLE_STEP = 10  # of the integration [s]
ELASTIC_TENSION = 11  # only of a loaded cable [N]
ELONGATION_RATE = 12  # only of a loaded cable [m/s]
# What they add to.
RADIUS_ADDED = 13  # [m]
TURN_ADDED = 14  # speed of the drum beyond the motor's, at the motor shaft [rad/s]
ELONGATION_ADDED = 15  # [m]
FORCE_ADDED = 16  # tension; fades with the elastic tension as the damper does [N]
SAG = 17  # elongation added, times the tension squared [m·N²]
LOADED_FORCE = 18  # tension, added when the elastic tension is known; fades likewise [N]
CARRIED_TENSION = 19  # with damper and all that was added so far, only of a loaded cable [N]
CABLE_SIGNALS = 20
# What effects on the winch frame read and change.
FRAME_SHIFT = 0  # of the exits, world axes [m]
FRAME_SHIFT_RATE = 3
FRAME_FORCE = 6  # of all cables on the frame, world axes, only of a loaded frame [N]
FRAME_SIGNALS = 9


@njit(cache=True, error_model="numpy", _nrt=False)
def sagging_tension(
    elongation: float,
    sag: float,
    elastic_length: float,
    scale: float,
    cables: Array,
    tables: Array,
    i: int,
) -> float:
    """Return the tension t [N] = law(elongation + sag/t²), by safeguarded Newton steps."""
    low = sqrt(sag / (abs(elongation) + 1.0))
    straight, _ = elastic_tension(elongation, elastic_length, scale, cables, tables, i)
    if straight > low:
        low = straight
    high = 2.0 * low
    for _ in range(60):
        found, slope = elastic_tension(
            elongation + sag / (high * high), elastic_length, scale, cables, tables, i
        )
        if found <= high:
            break
        low, high = high, 2.0 * high
    t = high
    for _ in range(60):
        found, slope = elastic_tension(
            elongation + sag / (t * t), elastic_length, scale, cables, tables, i
        )
        excess = found - t
        if excess > 0.0:
            low = t
        else:
            high = t
        step = excess / (1.0 + slope * 2.0 * sag / (t * t * t))
        t += step
        if not low <= t <= high:
            t = 0.5 * (low + high)
        if abs(step) <= 1e-13 * t or high - low <= 1e-13 * high:
            break
    return t


@njit(cache=True, error_model="numpy", _nrt=False)
def _shifted_frame(
    frame: Placement,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> Placement:
    for d in range(FRAME_SIGNALS):
        signals[d] = 0.0
    run_effects(FRAME, 0, 0, effects, effect_parameters, signals, state, out)
    p, rotation, v, turning = frame
    position = (p[0] + signals[0], p[1] + signals[1], p[2] + signals[2])
    velocity = (v[0] + signals[3], v[1] + signals[4], v[2] + signals[5])
    return position, rotation, velocity, turning


@njit(cache=True, error_model="numpy", _nrt=False)
def _load_frame(
    spans: Array,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> None:
    cursor = first_effect(LOADED_FRAME, effects)
    for d in range(3):
        signals[FRAME_FORCE + d] = 0.0
        for i in range(spans.shape[0]):
            signals[FRAME_FORCE + d] += spans[i, TENSION] * spans[i, DIRECTION + d]
    run_effects(LOADED_FRAME, 0, cursor, effects, effect_parameters, signals, state, out)


@njit(cache=True, error_model="numpy", _nrt=False)
def fill_cable_signals(
    i: int, state: Array, first: int, period: float, cables: Array, spans: Array, signals: Array
) -> None:
    """Write what effects on cable i read, and zero to what they add to."""
    n = cables.shape[0]
    signals[SPAN_LENGTH] = spans[i, LENGTH]
    signals[SPAN_RATE] = spans[i, RATE]
    signals[UNSTRETCHED] = state[first + i]
    signals[MOTOR_ANGLE] = state[first + n + i]
    signals[MOTOR_SPEED] = state[first + 2 * n + i]
    signals[WOUND_RADIUS] = cables[i, RADIUS]
    signals[DRUM_GEAR] = cables[i, GEAR_RATIO]
    x, y = spans[i, DIRECTION], spans[i, DIRECTION + 1]
    signals[HORIZONTAL] = sqrt(x * x + y * y) / cables[i, PARTS]
    signals[DOWNWARD] = spans[i, DIRECTION + 2] / cables[i, PARTS]
    signals[CABLE_GRAVITY] = cables[i, GRAVITY_HERE]
    signals[CABLE_STEP] = period
    for d in range(ELASTIC_TENSION, CABLE_SIGNALS):
        signals[d] = 0.0


@njit(cache=True, error_model="numpy", _nrt=False)
def _load_cable(
    i: int, state: Array, first: int, cables: Array, tables: Array, spans: Array, signals: Array
) -> float:
    """Leave the cable's tension in `spans`; return the rate of its unstretched length.

    As `cable.cable_tensions`, with what effects added.
    """
    n = cables.shape[0]
    unstretched = state[first + i]
    length = spans[i, LENGTH] if spans[i, LENGTH] > 0.0 else 1.0
    radius = cables[i, RADIUS] + signals[RADIUS_ADDED]
    turn = state[first + 2 * n + i] + signals[TURN_ADDED]
    rate = -unstretched * radius * turn / length
    elastic_length = unstretched + cables[i, OFFSET_LENGTH]
    scale = law_scale(elastic_length, cables, i)
    elongation = spans[i, LENGTH] - unstretched + signals[ELONGATION_ADDED]
    if signals[SAG] > 0.0:
        elastic = sagging_tension(
            elongation, signals[SAG], elastic_length, scale, cables, tables, i
        )
    else:
        elastic, _ = elastic_tension(elongation, elastic_length, scale, cables, tables, i)
    damping = cables[i, DAMPING_CONSTANT] - cables[i, DAMPING_SLOPE] * elastic_length
    if damping < 0.0:
        damping = 0.0
    added = signals[FORCE_ADDED]
    if elastic < cables[i, FLOOR_TENSION]:
        damping *= elastic / cables[i, FLOOR_TENSION]
        added *= elastic / cables[i, FLOOR_TENSION]
    tension = elastic + damping * (spans[i, RATE] - rate) + added
    has_cable = cables[i, HAS_CABLE] != 0.0
    spans[i, TENSION] = tension if tension > 0.0 and has_cable else 0.0
    signals[ELASTIC_TENSION] = elastic if has_cable else 0.0
    signals[ELONGATION_RATE] = spans[i, RATE] - rate
    signals[CARRIED_TENSION] = spans[i, TENSION]
    return rate if has_cable else 0.0


@njit(cache=True, error_model="numpy", _nrt=False)
def _add_tension(i: int, cables: Array, spans: Array, signals: Array) -> None:
    """Add to a cable's tension what effects add when its elastic tension is known."""
    elastic, floor = signals[ELASTIC_TENSION], cables[i, FLOOR_TENSION]
    fade = elastic / floor if elastic < floor else 1.0
    tension = spans[i, TENSION] + fade * signals[LOADED_FORCE]
    has_cable = cables[i, HAS_CABLE] != 0.0
    spans[i, TENSION] = tension if tension > 0.0 and has_cable else 0.0


def affected_signature(cables: Any) -> Any:  # noqa: ANN401 - numba's types
    """Return the signature of `affected_cables` for rows of cables of a type."""
    rows, matrix, integers = types.int64[:, ::1], types.float64[:, ::1], types.int64
    return _PLACEMENT(
        *(_VECTOR, _VECTOR, _PLACEMENT, _PLACEMENT, integers, types.boolean, types.float64),
        *(cables, types.float64[:, :, ::1], rows, matrix, cables, _VECTOR, _VECTOR),
    )


@njit(cache=True, error_model="numpy", _nrt=False)
def affected_cables(
    state: Array,
    torque: Array,
    frame: Placement,
    body: Placement,
    first: int,
    locked: bool,
    period: float,
    cables: Array,
    tables: Array,
    effects: Rows,
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    out: Array,
) -> Placement:
    """Write spans with tensions, and the rates of all cable, winch and effect states but the bar's.

    Arguments as `plant.plant_rate`; `first` is the index of the first unstretched length. Returns
    the winch frame's placement, effects on it included.
    """
    n = cables.shape[0]
    frame = _shifted_frame(frame, effects, effect_parameters, signals, state, out)
    cable_spans(cables, frame, body, spans)
    at_cable, at_loaded = first_effect(CABLE, effects), first_effect(LOADED_CABLE, effects)
    at_drive, at_winch = first_effect(DRIVE, effects), first_effect(WINCH, effects)
    for i in range(n):
        fill_cable_signals(i, state, first, period, cables, spans, signals)
        at_cable = run_effects(CABLE, i, at_cable, effects, effect_parameters, signals, state, out)
        out[first + i] = _load_cable(i, state, first, cables, tables, spans, signals)
        at_loaded = run_effects(
            LOADED_CABLE, i, at_loaded, effects, effect_parameters, signals, state, out
        )
        if signals[LOADED_FORCE] != 0.0:
            _add_tension(i, cables, spans, signals)
        radius_added = signals[RADIUS_ADDED]
        angle, speed, tension = state[first + n + i], state[first + 2 * n + i], spans[i, TENSION]
        fill_winch_signals(angle, speed, tension, torque[i], cables, i, signals)
        at_drive = run_effects(DRIVE, i, at_drive, effects, effect_parameters, signals, state, out)
        signals[RESISTANCE] += radius_added * tension
        at_winch = run_effects(WINCH, i, at_winch, effects, effect_parameters, signals, state, out)
        out[first + n + i] = speed
        out[first + 2 * n + i] = winch_acceleration(
            signals[REPORTED_TORQUE], tension, speed, period, cables, i, signals
        )
        if locked:
            out[first + 2 * n + i] = 0.0
    _load_frame(spans, effects, effect_parameters, signals, state, out)
    return frame


@njit(cache=True, error_model="numpy", _nrt=False)
def reported_torques(
    state: Array,
    torque: Array,
    first: int,
    cables: Array,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    scratch: Array,
    out: Array,
) -> None:
    """Write what the drives report for torque commands, (n,) [N·m], to `out`.

    `scratch` has the plant's number of states.
    """
    n = cables.shape[0]
    cursor = first_effect(DRIVE, effects)
    for i in range(n):
        angle, speed = state[first + n + i], state[first + 2 * n + i]
        fill_winch_signals(angle, speed, 0.0, torque[i], cables, i, signals)
        cursor = run_effects(DRIVE, i, cursor, effects, effect_parameters, signals, state, scratch)
        out[i] = signals[REPORTED_TORQUE]
