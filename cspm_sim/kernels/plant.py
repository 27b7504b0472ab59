"""The whole plant: winch, cable and bar blocks, and their fixed-step integration.

State: with a bar its position (3), Euler angles φ θ ψ (3), velocity in world axes (3) and angular
velocity in bar axes (3); then per cable the unstretched length, the motor angle and the motor
speed. 36 numbers for the thesis's machine (2-27).
"""

from math import isfinite
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_sim.kernels.bar import BAR_SIGNALS, VELOCITY, WRENCH, bar_acceleration
from cspm_sim.kernels.cable import (
    LENGTH,
    RADIUS,
    SPAN_COLUMNS,
    TENSION,
    cable_spans,
    cable_tensions,
    cable_wrench,
)
from cspm_sim.kernels.effect_call import call_kernel
from cspm_sim.kernels.motion import evaluate_motion
from cspm_sim.kernels.rotation import (
    Placement,
    Vector,
    body_rate_to_euler_rate,
    euler_rate_to_world_rate,
    rotate,
    rotation_from_euler,
)
from cspm_sim.kernels.winch import (
    ANGLE,
    DRY_LIMIT,
    RESISTANCE,
    SPEED,
    WINCH_SIGNALS,
    WINCH_TENSION,
    WINDING_RADIUS,
    winch_acceleration,
)

Array = NDArray[float64]

BAR_STATES = 12
WINCH_BLOCK = 0
BAR_BLOCK = 1


class PlantParameters(NamedTuple):
    """Everything constant, as flat arrays. `n` cables, `m` effects on single elements.

    Attributes:
        bar: bar parameters and gravity, empty without a bar; see `kernels.bar`.
        cables: shape (n, CABLE_COLUMNS), cables with their winches; see `kernels.cable`. In column
            order in memory, so that a processor takes several cables at a time.
        tables: shape (n, points, 2): tension and its slope along the stiffness law.
        effects: shape (m, 3): block, element (cable index, 0 for the bar), kernel address.
        effect_parameters: shape (m, widest).
    """

    bar: Array
    cables: Array
    tables: Array
    effects: NDArray[int64]
    effect_parameters: Array


class Scratch(NamedTuple):
    """Arrays that the kernels write between calls, so that stepping allocates nothing.

    The kernels are compiled with `_nrt=False`: without numba's memory management, whose reference
    counts took half of a step's time, and which would not compile if anything were allocated.
    """

    stages: Array
    spans: Array
    signals: Array


def make_scratch(n_states: int, n_cables: int) -> Scratch:
    """Return scratch arrays for a plant of this size."""
    return Scratch(
        stages=np.zeros((3, n_states)),
        spans=np.zeros((n_cables, SPAN_COLUMNS), order="F"),
        signals=np.zeros(max(BAR_SIGNALS, WINCH_SIGNALS)),
    )


@njit(cache=True, error_model="numpy", inline="always")
def frame_placement(frame: Array) -> Placement:
    """Return the winch frame's position, rotation, velocity and angular velocity."""
    rate = euler_rate_to_world_rate(frame[4], frame[5], frame[9], frame[10], frame[11])
    return (
        (frame[0], frame[1], frame[2]),
        rotation_from_euler(frame[3], frame[4], frame[5]),
        (frame[6], frame[7], frame[8]),
        rate,
    )


@njit(cache=True, error_model="numpy", inline="always")
def _bar_placement(state: Array, has_bar: bool) -> Placement:
    """Return the bar's placement; without a bar that of the world, where its cables end."""
    if not has_bar:
        zero = (0.0, 0.0, 0.0)
        return zero, rotation_from_euler(0.0, 0.0, 0.0), zero, zero
    rotation = rotation_from_euler(state[3], state[4], state[5])
    return (
        (state[0], state[1], state[2]),
        rotation,
        (state[6], state[7], state[8]),
        rotate(rotation, state[9], state[10], state[11]),
    )


@njit(cache=True, error_model="numpy")
def _effects_on_winch(
    i: int,
    angle: float,
    speed: float,
    tension: float,
    radius: float,
    effects: NDArray[int64],
    effect_parameters: Array,
    signals: Array,
) -> None:
    signals[ANGLE] = angle
    signals[SPEED] = speed
    signals[WINCH_TENSION] = tension
    signals[WINDING_RADIUS] = radius
    signals[RESISTANCE] = 0.0
    signals[DRY_LIMIT] = 0.0
    for e in range(effects.shape[0]):
        if effects[e, 0] == WINCH_BLOCK and effects[e, 1] == i:
            call_kernel(effects[e, 2], effect_parameters[e], signals)


@njit(cache=True, error_model="numpy")
def _effects_on_bar(
    velocity: Vector,
    rate: Vector,
    effects: NDArray[int64],
    effect_parameters: Array,
    signals: Array,
) -> None:
    """Leave the wrench that the effects add at the bar frame's origin in `signals`."""
    for d in range(3):
        signals[VELOCITY + d] = velocity[d]
        signals[VELOCITY + 3 + d] = rate[d]
        signals[WRENCH + d] = 0.0
        signals[WRENCH + 3 + d] = 0.0
    for e in range(effects.shape[0]):
        if effects[e, 0] == BAR_BLOCK:
            call_kernel(effects[e, 2], effect_parameters[e], signals)


@njit(cache=True, error_model="numpy", inline="always")
def _bar_rate(
    state: Array,
    placement: Placement,
    bar: Array,
    effects: NDArray[int64],
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    out: Array,
) -> None:
    _, rotation, velocity, world_rate = placement
    (fx, fy, fz), (mx, my, mz) = cable_wrench(spans)
    if effects.shape[0] > 0:
        _effects_on_bar(velocity, world_rate, effects, effect_parameters, signals)
        fx, fy, fz = fx + signals[WRENCH], fy + signals[WRENCH + 1], fz + signals[WRENCH + 2]
        mx, my, mz = mx + signals[WRENCH + 3], my + signals[WRENCH + 4], mz + signals[WRENCH + 5]
    rate = (state[9], state[10], state[11])
    linear, angular = bar_acceleration(bar, rotation, rate, (fx, fy, fz), (mx, my, mz))
    out[0], out[1], out[2] = velocity
    out[3], out[4], out[5] = body_rate_to_euler_rate(state[3], state[4], rate[0], rate[1], rate[2])
    out[6], out[7], out[8] = linear
    out[9], out[10], out[11] = angular


@njit(cache=True, error_model="numpy", inline="always")
def plant_rate(
    state: Array,
    torque: Array,
    frame: Placement,
    locked: bool,
    period: float,
    bar: Array,
    cables: Array,
    tables: Array,
    effects: NDArray[int64],
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    out: Array,
) -> None:
    """Write the state's time derivative to `out`.

    `torque` is the motor torque per winch [N·m], `frame` the winch frame's placement; `locked`
    holds all motors still; `period` is the step for dry friction [s]; then come the fields of
    `PlantParameters`, and scratch.
    """
    n = cables.shape[0]
    has_bar = bar.shape[0] > 0
    first = BAR_STATES if has_bar else 0
    placement = _bar_placement(state, has_bar)
    cable_spans(cables, frame, placement, spans)
    cable_tensions(cables, tables, state, first, spans, out)
    signals[RESISTANCE] = signals[DRY_LIMIT] = 0.0
    for i in range(n):
        angle, speed = state[first + n + i], state[first + 2 * n + i]
        tension = spans[i, TENSION]
        if effects.shape[0] > 0:
            radius = cables[i, RADIUS]
            _effects_on_winch(i, angle, speed, tension, radius, effects, effect_parameters, signals)
        out[first + n + i] = speed
        out[first + 2 * n + i] = winch_acceleration(
            torque[i], tension, speed, period, cables, i, signals
        )
        if locked:
            out[first + 2 * n + i] = 0.0
    if has_bar:
        _bar_rate(state, placement, bar, effects, effect_parameters, spans, signals, out)


@njit(cache=True, error_model="numpy", _nrt=False)
def plant_tensions(
    state: Array, frame: Array, p: PlantParameters, scratch: Scratch, out: Array
) -> None:
    """Write tension and stretched length per cable, shape (2, n), to `out`."""
    has_bar = p.bar.shape[0] > 0
    first = BAR_STATES if has_bar else 0
    spans = scratch.spans
    cable_spans(p.cables, frame_placement(frame), _bar_placement(state, has_bar), spans)
    cable_tensions(p.cables, p.tables, state, first, spans, scratch.stages[0])
    for i in range(p.cables.shape[0]):
        out[0, i] = spans[i, TENSION]
        out[1, i] = spans[i, LENGTH]


@njit(cache=True, error_model="numpy", _nrt=False)
def plant_step(
    state: Array,
    torque: Array,
    frames: Array,
    locked: bool,
    period: float,
    p: PlantParameters,
    scratch: Scratch,
) -> int:
    """Advance `state` in place by one classical Runge-Kutta step; return the first bad state or -1.

    `torque` is held over the step; `frames` has the winch frame at its start, middle and end.
    """
    n = state.shape[0]
    bar, cables, tables, effects = p.bar, p.cables, p.tables, p.effects
    effect_parameters, spans, signals = p.effect_parameters, scratch.spans, scratch.signals
    stage, rate, total = scratch.stages[0], scratch.stages[1], scratch.stages[2]
    for j in range(n):
        stage[j] = state[j]
        total[j] = 0.0
    frame = frame_placement(frames[0])
    for s in range(4):
        if s == 1 or s == 3:
            frame = frame_placement(frames[(s + 1) // 2])
        plant_rate(
            stage,
            torque,
            frame,
            locked,
            period,
            bar,
            cables,
            tables,
            effects,
            effect_parameters,
            spans,
            signals,
            rate,
        )
        weight = 1.0 if s == 0 or s == 3 else 2.0
        reach = 0.5 * period if s < 2 else period
        for j in range(n):
            total[j] += weight * rate[j]
            stage[j] = state[j] + reach * rate[j]
    bad = -1
    for j in range(n):
        state[j] += period / 6.0 * total[j]
        if bad < 0 and not isfinite(state[j]):
            bad = j
    return bad


@njit(cache=True, error_model="numpy", _nrt=False)
def plant_advance(
    state: Array,
    torque: Array,
    knots: Array,
    spacing: float,
    periodic: bool,
    start: int,
    steps: int,
    locked: bool,
    period: float,
    p: PlantParameters,
    frames: Array,
    scratch: Scratch,
    outputs: Array,
) -> int:
    """Advance `state` by `steps` steps from step number `start` with `torque` held.

    The winch frame follows the motion of `knots` (see `motion.Motion`) and is left in `frames[0]`,
    shape (3, 18); `outputs` is left as by `plant_tensions`. Returns the first bad state, or -1 when
    all states are finite.
    """
    evaluate_motion(start * period, knots, spacing, periodic, frames[0])
    for k in range(start, start + steps):
        evaluate_motion((k + 0.5) * period, knots, spacing, periodic, frames[1])
        evaluate_motion((k + 1) * period, knots, spacing, periodic, frames[2])
        bad = plant_step(state, torque, frames, locked, period, p, scratch)
        if bad >= 0:
            return bad
        for d in range(frames.shape[1]):
            frames[0, d] = frames[2, d]
    plant_tensions(state, frames[0], p, scratch, outputs)
    return -1
