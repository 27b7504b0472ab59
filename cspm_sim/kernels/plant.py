"""The whole plant: winch, cable and bar blocks, and their fixed-step integration.

State: with a bar its position (3), Euler angles φ θ ψ (3), velocity in world axes (3) and angular
velocity in bar axes (3); then per cable the unstretched length, the motor angle and the motor
speed. 36 numbers for the thesis's machine (2-27). The states of effects with memory follow.
"""

from math import isfinite
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.bar import bar_acceleration
from cspm_model.kernels.cable import (
    LENGTH,
    SPAN_COLUMNS,
    TENSION,
    cable_spans,
    cable_tensions,
    cable_wrench,
)
from cspm_model.kernels.machine import BAR_STATES, PlantParameters, bar_placement, frame_placement
from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.rotation import (
    Placement,
    body_rate_to_euler_rate,
)
from cspm_sim.kernels.affected_cables import CABLE_SIGNALS, call_affected_cables
from cspm_sim.kernels.bar_effects import END_SIGNALS, PENDANT_SIGNALS, call_effects_on_bar
from cspm_sim.kernels.hooks import AFFECTED, FIRST_STATE, HOOK, ON_BAR, STATES, WINCH, run_effects
from cspm_sim.kernels.winch import (
    DRY_LIMIT,
    RESISTANCE,
    WINCH_SIGNALS,
    fill_winch_signals,
    winch_acceleration,
)

Array = NDArray[float64]


class Scratch(NamedTuple):
    """Arrays that the kernels write between calls, so that stepping allocates nothing.

    The kernels are compiled with `_nrt=False`: without numba's memory management, whose reference
    counts took half of a step's time, and which would not compile if anything were allocated.
    """

    stages: Array
    spans: Array
    signals: Array


def state_count(p: PlantParameters) -> int:
    """Return the number of states, those of effects included."""
    own = (BAR_STATES if len(p.bar) else 0) + 3 * len(p.cables)
    return int(max([own, *(p.effects[:, FIRST_STATE] + p.effects[:, STATES])]))


def make_scratch(n_states: int, n_cables: int) -> Scratch:
    """Return scratch arrays for a plant of this size."""
    return Scratch(
        stages=np.zeros((3, n_states)),
        spans=np.zeros((n_cables, SPAN_COLUMNS), order="F"),
        signals=np.zeros(max(CABLE_SIGNALS, END_SIGNALS, PENDANT_SIGNALS, WINCH_SIGNALS)),
    )


@njit(cache=True, error_model="numpy", inline="always")
def bar_rate(
    state: Array,
    frame: Placement,
    placement: Placement,
    bar: Array,
    cables: Array,
    effects: NDArray[int64],
    effect_parameters: Array,
    spans: Array,
    signals: Array,
    out: Array,
) -> None:
    """Write the time derivative of the bar's 12 states to `out`, under the tensions in `spans`."""
    _, rotation, velocity, _ = placement
    force, moment = cable_wrench(spans)
    if effects.shape[0] > 0 and effects[0, ON_BAR] != 0:
        force, moment = call_effects_on_bar(
            effects[0, ON_BAR],
            state,
            frame,
            placement,
            force,
            moment,
            bar,
            cables,
            effects,
            effect_parameters,
            spans,
            signals,
            out,
        )
    rate = (state[9], state[10], state[11])
    linear, angular = bar_acceleration(bar, rotation, rate, force, moment)
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
    placement = bar_placement(state, has_bar)
    if effects.shape[0] > 0 and effects[0, HOOK] < WINCH:
        frame = call_affected_cables(
            effects[0, AFFECTED],
            state,
            torque,
            frame,
            placement,
            first,
            locked,
            period,
            cables,
            tables,
            effects,
            effect_parameters,
            spans,
            signals,
            out,
        )
    else:
        cable_spans(cables, frame, placement, spans)
        cable_tensions(cables, tables, state, first, spans, out)
        signals[RESISTANCE] = signals[DRY_LIMIT] = 0.0
        on_winches = effects.shape[0] > 0 and effects[0, HOOK] == WINCH
        cursor = 0
        for i in range(n):
            angle, speed = state[first + n + i], state[first + 2 * n + i]
            tension = spans[i, TENSION]
            if on_winches:
                fill_winch_signals(angle, speed, tension, torque[i], cables, i, signals)
                cursor = run_effects(
                    WINCH, i, cursor, effects, effect_parameters, signals, state, out
                )
            out[first + n + i] = speed
            out[first + 2 * n + i] = winch_acceleration(
                torque[i], tension, speed, period, cables, i, signals
            )
            if locked:
                out[first + 2 * n + i] = 0.0
    if has_bar:
        bar_rate(
            state,
            frame,
            placement,
            bar,
            cables,
            effects,
            effect_parameters,
            spans,
            signals,
            out,
        )


@njit(cache=True, error_model="numpy", _nrt=False)
def plant_tensions(
    state: Array, frame: Array, p: PlantParameters, scratch: Scratch, out: Array
) -> None:
    """Write tension and stretched length per cable, shape (2, n), to `out`."""
    has_bar = p.bar.shape[0] > 0
    first = BAR_STATES if has_bar else 0
    spans = scratch.spans
    placement = bar_placement(state, has_bar)
    if p.effects.shape[0] > 0 and p.effects[0, HOOK] < WINCH:
        call_affected_cables(
            p.effects[0, AFFECTED],
            state,
            scratch.stages[1],
            frame_placement(frame),
            placement,
            first,
            True,
            1.0,
            p.cables,
            p.tables,
            p.effects,
            p.effect_parameters,
            spans,
            scratch.signals,
            scratch.stages[0],
        )
    else:
        cable_spans(p.cables, frame_placement(frame), placement, spans)
        cable_tensions(p.cables, p.tables, state, first, spans, scratch.stages[0])
    for i in range(p.cables.shape[0]):
        out[0, i] = spans[i, TENSION]
        out[1, i] = spans[i, LENGTH]


@njit(cache=True, error_model="numpy", inline="always")
def begin_stages(state: Array, total: Array, stage: Array) -> None:
    """Begin a classical Runge-Kutta step at `state`."""
    for j in range(state.shape[0]):
        stage[j] = state[j]
        total[j] = 0.0


@njit(cache=True, error_model="numpy", inline="always")
def add_stage(s: int, period: float, state: Array, rate: Array, total: Array, stage: Array) -> None:
    """Add the rate at stage `s`, 0 to 3, to the total; leave the next stage's state in `stage`."""
    weight = 1.0 if s == 0 or s == 3 else 2.0
    reach = 0.5 * period if s < 2 else period
    for j in range(state.shape[0]):
        total[j] += weight * rate[j]
        stage[j] = state[j] + reach * rate[j]


@njit(cache=True, error_model="numpy", inline="always")
def end_stages(period: float, total: Array, state: Array) -> int:
    """Advance `state` by the step; return the first state that is not finite, or -1."""
    bad = -1
    for j in range(state.shape[0]):
        state[j] += period / 6.0 * total[j]
        if bad < 0 and not isfinite(state[j]):
            bad = j
    return bad


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
    bar, cables, tables, effects = p.bar, p.cables, p.tables, p.effects
    effect_parameters, spans, signals = p.effect_parameters, scratch.spans, scratch.signals
    stage, rate, total = scratch.stages[0], scratch.stages[1], scratch.stages[2]
    begin_stages(state, total, stage)
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
        add_stage(s, period, state, rate, total, stage)
    return end_stages(period, total, state)


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
