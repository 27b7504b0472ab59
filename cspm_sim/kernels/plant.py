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
from cspm_sim.kernels.cable import HAS_CABLE, OFFSET_LENGTH, cable_span, cable_tension
from cspm_sim.kernels.effect_call import call_kernel
from cspm_sim.kernels.motion import evaluate_motion
from cspm_sim.kernels.rotation import (
    Matrix,
    Vector,
    body_rate_to_euler_rate,
    cross,
    euler_rate_to_world_rate,
    rotate,
    rotation_from_euler,
)
from cspm_sim.kernels.winch import (
    ANGLE,
    DRY_LIMIT,
    RADIUS,
    RESISTANCE,
    SPEED,
    TENSION,
    WINCH_SIGNALS,
    WINDING_RADIUS,
    winch_acceleration,
)

Array = NDArray[float64]

BAR_STATES = 12
WINCH_BLOCK = 0
BAR_BLOCK = 1
SIGNALS = max(BAR_SIGNALS, WINCH_SIGNALS)


class PlantParameters(NamedTuple):
    """Everything constant, as flat arrays. `n` cables, `m` effects on single elements.

    Attributes:
        gravity: [m/s²], along +z.
        bar: bar parameters, empty without a bar; see `kernels.bar`.
        cables: shape (n, CABLE_COLUMNS); see `kernels.cable`.
        tables: shape (n, points, 2): tension and its slope along the stiffness law.
        winches: shape (n, WINCH_COLUMNS); see `kernels.winch`.
        effect_blocks: shape (m,): block that each effect changes.
        effect_elements: shape (m,): cable index, 0 for the bar.
        effect_addresses: shape (m,): compiled kernels.
        effect_parameters: shape (m, widest).
    """

    gravity: float
    bar: Array
    cables: Array
    tables: Array
    winches: Array
    effect_blocks: NDArray[int64]
    effect_elements: NDArray[int64]
    effect_addresses: NDArray[int64]
    effect_parameters: Array


@njit(cache=True, error_model="numpy")
def _frame_placement(frame: Array) -> tuple[Vector, Matrix, Vector, Vector]:
    """Return the winch frame's position, rotation, velocity and angular velocity."""
    rate = euler_rate_to_world_rate(frame[4], frame[5], frame[9], frame[10], frame[11])
    return (
        (frame[0], frame[1], frame[2]),
        rotation_from_euler(frame[3], frame[4], frame[5]),
        (frame[6], frame[7], frame[8]),
        rate,
    )


@njit(cache=True, error_model="numpy")
def _bar_placement(state: Array, has_bar: bool) -> tuple[Vector, Matrix, Vector, Vector]:
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
    i: int, angle: float, speed: float, tension: float, p: PlantParameters, signals: Array
) -> None:
    signals[ANGLE] = angle
    signals[SPEED] = speed
    signals[TENSION] = tension
    signals[WINDING_RADIUS] = p.winches[i, RADIUS]
    signals[RESISTANCE] = 0.0
    signals[DRY_LIMIT] = 0.0
    for e in range(p.effect_blocks.shape[0]):
        if p.effect_blocks[e] == WINCH_BLOCK and p.effect_elements[e] == i:
            call_kernel(p.effect_addresses[e], p.effect_parameters[e], signals)


@njit(cache=True, error_model="numpy")
def _effects_on_bar(
    velocity: Vector, rate: Vector, p: PlantParameters, signals: Array
) -> tuple[Vector, Vector]:
    """Return force and moment that the effects add at the bar frame's origin, world axes."""
    for d in range(3):
        signals[VELOCITY + d] = velocity[d]
        signals[VELOCITY + 3 + d] = rate[d]
        signals[WRENCH + d] = 0.0
        signals[WRENCH + 3 + d] = 0.0
    for e in range(p.effect_blocks.shape[0]):
        if p.effect_blocks[e] == BAR_BLOCK:
            call_kernel(p.effect_addresses[e], p.effect_parameters[e], signals)
    w = WRENCH
    return (signals[w], signals[w + 1], signals[w + 2]), (
        signals[w + 3],
        signals[w + 4],
        signals[w + 5],
    )


@njit(cache=True, error_model="numpy")
def plant_rate(
    state: Array,
    torque: Array,
    frame: Array,
    locked: bool,
    period: float,
    p: PlantParameters,
    signals: Array,
    out: Array,
) -> None:
    """Write the state's time derivative to `out`.

    `torque` is the motor torque per winch [N·m], `frame` the winch frame's pose and pose rate (at
    least 12 numbers), `locked` holds all motors still, `period` is the step for dry friction [s],
    `signals` is scratch of SIGNALS numbers.
    """
    cables, tables, winches = p.cables, p.tables, p.winches
    n = cables.shape[0]
    has_bar = p.bar.shape[0] > 0
    has_effects = p.effect_blocks.shape[0] > 0
    first = BAR_STATES if has_bar else 0
    fp, fr, fv, fw = _frame_placement(frame)
    bp, br, bv, bw = _bar_placement(state, has_bar)
    fx = fy = fz = mx = my = mz = 0.0
    if not has_effects:
        signals[RESISTANCE] = signals[DRY_LIMIT] = 0.0
    for i in range(n):
        angle, speed = state[first + n + i], state[first + 2 * n + i]
        tension = 0.0
        unstretched_rate = 0.0
        if cables[i, HAS_CABLE] != 0.0:
            unstretched = state[first + i]
            u, arm, length, length_rate = cable_span(cables, i, fp, fr, fv, fw, bp, br, bv, bw)
            # The winch winds stretched cable, thesis (2-16..2-18).
            unstretched_rate = -(unstretched / length) * winches[i, RADIUS] * speed
            tension = cable_tension(
                length - unstretched,
                length_rate - unstretched_rate,
                unstretched + cables[i, OFFSET_LENGTH],
                cables,
                tables,
                i,
            )
            tx, ty, tz = -tension * u[0], -tension * u[1], -tension * u[2]
            nx, ny, nz = cross(arm[0], arm[1], arm[2], tx, ty, tz)
            fx, fy, fz = fx + tx, fy + ty, fz + tz
            mx, my, mz = mx + nx, my + ny, mz + nz
        if has_effects:
            _effects_on_winch(i, angle, speed, tension, p, signals)
        out[first + i] = unstretched_rate
        out[first + n + i] = speed
        out[first + 2 * n + i] = (
            0.0
            if locked
            else winch_acceleration(torque[i], tension, speed, period, winches, i, signals)
        )
    if has_bar:
        if has_effects:
            (ex, ey, ez), (gx, gy, gz) = _effects_on_bar(bv, bw, p, signals)
            fx, fy, fz = fx + ex, fy + ey, fz + ez
            mx, my, mz = mx + gx, my + gy, mz + gz
        rate = (state[9], state[10], state[11])
        out[0], out[1], out[2] = bv
        out[3], out[4], out[5] = body_rate_to_euler_rate(
            state[3], state[4], rate[0], rate[1], rate[2]
        )
        linear, angular = bar_acceleration(
            p.bar, p.gravity, br, rate, (fx, fy, fz), (mx, my, mz)
        )
        out[6], out[7], out[8] = linear
        out[9], out[10], out[11] = angular


@njit(cache=True, error_model="numpy")
def plant_tensions(state: Array, frame: Array, p: PlantParameters, out: Array) -> None:
    """Write tension and stretched length per cable, shape (2, n), to `out`."""
    n = p.cables.shape[0]
    has_bar = p.bar.shape[0] > 0
    first = BAR_STATES if has_bar else 0
    fp, fr, fv, fw = _frame_placement(frame)
    bp, br, bv, bw = _bar_placement(state, has_bar)
    for i in range(n):
        out[0, i] = out[1, i] = 0.0
        if p.cables[i, HAS_CABLE] == 0.0:
            continue
        unstretched = state[first + i]
        _, _, length, length_rate = cable_span(p.cables, i, fp, fr, fv, fw, bp, br, bv, bw)
        speed = state[first + 2 * n + i]
        unstretched_rate = -(unstretched / length) * p.winches[i, RADIUS] * speed
        out[0, i] = cable_tension(
            length - unstretched,
            length_rate - unstretched_rate,
            unstretched + p.cables[i, OFFSET_LENGTH],
            p.cables,
            p.tables,
            i,
        )
        out[1, i] = length


@njit(cache=True, error_model="numpy")
def plant_step(
    state: Array,
    torque: Array,
    frames: Array,
    locked: bool,
    period: float,
    p: PlantParameters,
    work: Array,
    signals: Array,
) -> int:
    """Advance `state` in place by one classical Runge-Kutta step; return the first bad state or -1.

    `torque` is held over the step; `frames` has the winch frame at its start, middle and end; `work`
    is scratch of shape (5, states).
    """
    n = state.shape[0]
    k1, k2, k3, k4, stage = work[0], work[1], work[2], work[3], work[4]
    plant_rate(state, torque, frames[0], locked, period, p, signals, k1)
    for j in range(n):
        stage[j] = state[j] + 0.5 * period * k1[j]
    plant_rate(stage, torque, frames[1], locked, period, p, signals, k2)
    for j in range(n):
        stage[j] = state[j] + 0.5 * period * k2[j]
    plant_rate(stage, torque, frames[1], locked, period, p, signals, k3)
    for j in range(n):
        stage[j] = state[j] + period * k3[j]
    plant_rate(stage, torque, frames[2], locked, period, p, signals, k4)
    bad = -1
    for j in range(n):
        state[j] += period / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j])
        if bad < 0 and not isfinite(state[j]):
            bad = j
    return bad


@njit(cache=True, error_model="numpy")
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
    work: Array,
) -> int:
    """Advance `state` by `steps` steps from step number `start` with `torque` held.

    The winch frame follows the motion of `knots` (see `motion.Motion`) and is left in `frames[0]`,
    shape (3, 18); `work` is scratch of shape (5, states). Returns the first bad state, or -1 when all
    states are finite.
    """
    signals = np.zeros(SIGNALS)
    evaluate_motion(start * period, knots, spacing, periodic, frames[0])
    for k in range(start, start + steps):
        evaluate_motion((k + 0.5) * period, knots, spacing, periodic, frames[1])
        evaluate_motion((k + 1) * period, knots, spacing, periodic, frames[2])
        bad = plant_step(state, torque, frames, locked, period, p, work, signals)
        if bad >= 0:
            return bad
        frames[0, :] = frames[2, :]
    return -1
