"""Parts of the plant that take measured signals as input instead of simulated ones.

From winches: motor angles given, bar and cables simulated. From torques: the whole plant.
From tensions: tensions given, the bar alone simulated. Shafts: torques and tensions given, the
winches alone simulated. All take the classical Runge-Kutta step of `plant_step`. Time begins
with the motion's first knot; a window begins at a step of it.
"""

from math import isfinite

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import TENSION, cable_spans
from cspm_model.kernels.machine import BAR_STATES, PlantParameters, bar_placement, frame_placement
from cspm_model.kernels.motion import evaluate_motion
from cspm_sim.kernels.affected_cables import RADIUS_ADDED, fill_cable_signals
from cspm_sim.kernels.hooks import CABLE, WINCH, first_effect, run_effects
from cspm_sim.kernels.plant import (
    Scratch,
    add_stage,
    bar_rate,
    begin_stages,
    end_stages,
    plant_rate,
    plant_step,
    plant_tensions,
)
from cspm_sim.kernels.winch import RESISTANCE, fill_winch_signals, winch_acceleration

Array = NDArray[float64]


@njit(cache=True, error_model="numpy", inline="always")
def _begin_frames(start: int, period: float, knots: Array, spacing: float, frames: Array) -> None:
    """Put the winch frame at a window's start where the first step looks for it."""
    evaluate_motion(start * period, knots, spacing, False, frames[2])


@njit(cache=True, error_model="numpy", inline="always")
def _next_frames(step: int, period: float, knots: Array, spacing: float, frames: Array) -> None:
    """Put the winch frame at begin, middle and end of a step; `frames[2]` has its begin."""
    for d in range(frames.shape[1]):
        frames[0, d] = frames[2, d]
    evaluate_motion((step + 0.5) * period, knots, spacing, False, frames[1])
    evaluate_motion((step + 1) * period, knots, spacing, False, frames[2])


@njit(cache=True, error_model="numpy", inline="always")
def _turn(
    state: Array, first: int, angles: Array, speeds: Array, k: int, half: int, period: float
) -> None:
    """Put the winches where they were measured, `half` half steps after step k.

    Between samples the angle is their cubic Hermite interpolant, and the speed its derivative.
    """
    n = angles.shape[1]
    for i in range(n):
        if half == 1:
            q0, q1, v0, v1 = angles[k, i], angles[k + 1, i], speeds[k, i], speeds[k + 1, i]
            angle = 0.5 * (q0 + q1) + 0.125 * period * (v0 - v1)
            speed = 1.5 * (q1 - q0) / period - 0.25 * (v0 + v1)
        else:
            angle, speed = angles[k + half // 2, i], speeds[k + half // 2, i]
        state[first + n + i] = angle
        state[first + 2 * n + i] = speed


@njit(cache=True, error_model="numpy", inline="always")
def _hold(state: Array, bars: Array, k: int, half: int) -> None:
    """Put the bar where it was measured, `half` half steps after step k; if it was."""
    if bars.shape[0] == 0:
        return
    for d in range(BAR_STATES):
        if half == 1:
            state[d] = 0.5 * (bars[k, d] + bars[k + 1, d])
        else:
            state[d] = bars[k + half // 2, d]


@njit(cache=True, error_model="numpy", _nrt=False)
def _note(
    state: Array, frame: Array, p: PlantParameters, scratch: Scratch, outputs: Array, row: Array
) -> bool:
    """Write state and tensions to `row`; return whether the state is finite."""
    plant_tensions(state, frame, p, scratch, outputs)
    size, n = state.shape[0], p.cables.shape[0]
    whole = True
    for j in range(size):
        row[j] = state[j]
        whole = whole and isfinite(state[j])
    for i in range(n):
        row[size + i] = outputs[0, i]
    return whole


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def simulate_from_winches(
    state: Array,
    angles: Array,
    speeds: Array,
    bars: Array,
    knots: Array,
    spacing: float,
    start: int,
    period: float,
    p: PlantParameters,
    frames: Array,
    scratch: Scratch,
    outputs: Array,
    out: Array,
) -> int:
    """Simulate bar and cables under measured winch motion; return how many rows are good.

    `angles`, `speeds`: (steps + 1, n) [rad, rad/s] at the motor shafts; `bars`: the bar's states,
    (steps + 1, 12), which leaves the cables alone to be simulated, or (0, 12) to simulate it too;
    `knots`, `spacing`: the winch frame's motion; `frames` (3, 18) and `outputs` (2, n): scratch.
    `out`, (steps + 1, states + n), takes the states and the tensions at each step.
    """
    steps = angles.shape[0] - 1
    first = BAR_STATES if p.bar.shape[0] > 0 else 0
    stage, rate, total = scratch.stages[0], scratch.stages[1], scratch.stages[2]
    _begin_frames(start, period, knots, spacing, frames)
    _turn(state, first, angles, speeds, 0, 0, period)
    _hold(state, bars, 0, 0)
    for k in range(steps):
        if not _note(state, frames[2], p, scratch, outputs, out[k]):
            return k
        _next_frames(start + k, period, knots, spacing, frames)
        begin_stages(state, total, stage)
        for s in range(4):
            _turn(stage, first, angles, speeds, k, (s + 1) // 2, period)
            _hold(stage, bars, k, (s + 1) // 2)
            plant_rate(
                stage,
                outputs[0],
                frame_placement(frames[(s + 1) // 2]),
                False,
                period,
                p.bar,
                p.cables,
                p.tables,
                p.effects,
                p.effect_parameters,
                scratch.spans,
                scratch.signals,
                rate,
            )
            add_stage(s, period, state, rate, total, stage)
        end_stages(period, total, state)
        _turn(state, first, angles, speeds, k, 2, period)
        _hold(state, bars, k, 2)
    return steps + 1 if _note(state, frames[2], p, scratch, outputs, out[steps]) else steps


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def simulate_from_torques(
    state: Array,
    torques: Array,
    knots: Array,
    spacing: float,
    start: int,
    period: float,
    p: PlantParameters,
    frames: Array,
    scratch: Scratch,
    outputs: Array,
    out: Array,
) -> int:
    """Simulate the whole plant under measured torques; return how many rows are good.

    `torques`: (steps, n) [N·m] at the motor shafts, each held over its step; the rest as in
    `simulate_from_winches`.
    """
    steps = torques.shape[0]
    _begin_frames(start, period, knots, spacing, frames)
    for k in range(steps):
        if not _note(state, frames[2], p, scratch, outputs, out[k]):
            return k
        _next_frames(start + k, period, knots, spacing, frames)
        plant_step(state, torques[k], frames, False, period, p, scratch)
    return steps + 1 if _note(state, frames[2], p, scratch, outputs, out[steps]) else steps


@njit(cache=True, error_model="numpy", inline="always")
def _bar_rate_under(
    state: Array,
    tensions: Array,
    k: int,
    half: int,
    frame: Array,
    p: PlantParameters,
    scratch: Scratch,
    out: Array,
) -> None:
    placement = bar_placement(state, True)
    cable_spans(p.cables, frame_placement(frame), placement, scratch.spans)
    for i in range(tensions.shape[1]):
        change = tensions[k + 1, i] - tensions[k, i]
        scratch.spans[i, TENSION] = tensions[k, i] + 0.5 * half * change
    bar_rate(
        state,
        frame_placement(frame),
        placement,
        p.bar,
        p.cables,
        p.effects,
        p.effect_parameters,
        scratch.spans,
        scratch.signals,
        out,
    )


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def simulate_from_tensions(
    state: Array,
    tensions: Array,
    knots: Array,
    spacing: float,
    start: int,
    period: float,
    p: PlantParameters,
    frames: Array,
    scratch: Scratch,
    out: Array,
) -> int:
    """Simulate the bar alone under measured tensions; return how many rows are good.

    `state`: the plant's, of which the bar's 12 and the effects' memory are used; `tensions`:
    (steps + 1, n) [N], joined by straight lines; `out`: (steps + 1, 12); the rest as in
    `simulate_from_winches`.
    """
    steps = tensions.shape[0] - 1
    stage, rate, total = scratch.stages[0], scratch.stages[1], scratch.stages[2]
    rate[:] = 0.0
    _begin_frames(start, period, knots, spacing, frames)
    for k in range(steps + 1):
        for d in range(BAR_STATES):
            out[k, d] = state[d]
            if not isfinite(state[d]):
                return k
        if k == steps:
            break
        _next_frames(start + k, period, knots, spacing, frames)
        begin_stages(state, total, stage)
        for s in range(4):
            half = (s + 1) // 2
            _bar_rate_under(stage, tensions, k, half, frames[half], p, scratch, rate)
            add_stage(s, period, state, rate, total, stage)
        end_stages(period, total, state)
    return steps + 1


@njit(cache=True, error_model="numpy", inline="always")
def _shaft_rates_under(
    state: Array,
    first: int,
    torques: Array,
    tensions: Array,
    k: int,
    half: int,
    period: float,
    p: PlantParameters,
    scratch: Scratch,
    out: Array,
) -> None:
    n = p.cables.shape[0]
    signals = scratch.signals
    at_cable, at_winch = first_effect(CABLE, p.effects), first_effect(WINCH, p.effects)
    for i in range(n):
        # Of what acts on the cable, the shaft feels a change of the radius at which it winds.
        fill_cable_signals(i, state, first, period, p.cables, scratch.spans, signals)
        at_cable = run_effects(
            CABLE, i, at_cable, p.effects, p.effect_parameters, signals, state, out
        )
        radius_added = signals[RADIUS_ADDED]
        tension = tensions[k, i] + 0.5 * half * (tensions[k + 1, i] - tensions[k, i])
        angle, speed = state[first + n + i], state[first + 2 * n + i]
        fill_winch_signals(angle, speed, tension, torques[k, i], p.cables, i, signals)
        signals[RESISTANCE] += radius_added * tension
        at_winch = run_effects(
            WINCH, i, at_winch, p.effects, p.effect_parameters, signals, state, out
        )
        out[first + n + i] = speed
        out[first + 2 * n + i] = winch_acceleration(
            torques[k, i], tension, speed, period, p.cables, i, signals
        )


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def simulate_shafts(
    state: Array,
    torques: Array,
    tensions: Array,
    period: float,
    p: PlantParameters,
    scratch: Scratch,
    out: Array,
) -> int:
    """Simulate winches alone under measured torques and tensions; return how many rows are good.

    `state`: the plant's, of which angles, speeds and the effects' memory are used; `torques`:
    (steps, n) [N·m], each held over its step; `tensions`: (steps + 1, n) [N], joined by straight
    lines; `out`: (steps + 1, states).
    """
    steps = torques.shape[0]
    first = BAR_STATES if p.bar.shape[0] > 0 else 0
    stage, rate, total = scratch.stages[0], scratch.stages[1], scratch.stages[2]
    rate[:] = 0.0
    scratch.spans[:] = 1.0
    for j in range(state.shape[0]):
        out[0, j] = state[j]
    for k in range(steps):
        begin_stages(state, total, stage)
        for s in range(4):
            _shaft_rates_under(
                stage, first, torques, tensions, k, (s + 1) // 2, period, p, scratch, rate
            )
            add_stage(s, period, state, rate, total, stage)
        if end_stages(period, total, state) >= 0:
            return k + 1
        for j in range(state.shape[0]):
            out[k + 1, j] = state[j]
    return steps + 1
