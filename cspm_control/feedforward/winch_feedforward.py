"""Torque ahead of what winches take to change tensions, to follow the references and to stretch."""

from __future__ import annotations

from math import exp

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.cable import (
    ARM,
    DAMPING_CONSTANT,
    DAMPING_SLOPE,
    DIRECTION,
    EXIT,
    INERTIA,
    LENGTH,
    OFFSET_LENGTH,
    PARTS,
    PULLEY_AXIS,
    PULLEY_RADIUS,
    RADIUS,
    RATE,
    ROUTE,
    SPAN_COLUMNS,
    cable_spans,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.pulley import pulley_turning
from cspm_model.kernels.rotation import (
    Matrix,
    Placement,
    Vector,
    cross,
    euler_from_quaternion,
    rotate,
    rotation_from_euler,
)
from cspm_model.kernels.route import STOP_COUNT

Array = NDArray[np.float64]

# What is remembered per cable: the wanted tension after one and two filters [N], the elongation
# [m] that it makes, and how fast that grows [m/s].
ONCE, TWICE, ELONGATION, STRETCHING, MEMORY = 0, 1, 2, 3, 4
# Numbers of the filters: share of a new value, and the time between steps [s].
FRESH, PERIOD = 0, 1
# Newton steps from here [m] to the elongation of a cable at rest; half of them are never needed.
FIRST_ELONGATION, NEWTON_STEPS = 1e-3, 50
LEAST_ELONGATION = 1e-9
# Over twice this time the rate of a cable with a route is differenced [s].
_STEP = 1e-4


class WinchFeedforward:
    """The torque that winches take if bar, frame and tensions are to move as their references do.

    By the winch's equation J·q̈ = τ − r·t (2-20) and its winding (2-16 to 2-18) that is

        τ = r·(t − t₀) + (J/r)·(l/l0)·(ε̈ − l̈)

    with the wanted tension t, t₀ that of the first step, the references' cable length l and the
    elongation ε that t makes of the cable with its law and damper: B·ε̇ + t_el(ε) = t (2-19). For
    two derivatives of ε the wanted tension is smoothed by two equal filters.
    """

    def __init__(
        self, parameters: PlantParameters, stretch_bandwidth: float | None, *, period: float
    ) -> None:
        """Take the machine, the filters' bandwidth [rad/s] and the time between steps [s].

        Without the bandwidth cables are taken as stiff: ε̈ = 0.
        """
        self.cables, self.tables = parameters.cables, parameters.tables
        fresh = 0.0 if stretch_bandwidth is None else 1.0 - exp(-stretch_bandwidth * period)
        self.numbers = np.array([fresh, period])
        n = len(self.cables)
        self.memory, self.first = np.zeros((n, MEMORY)), np.zeros(n)
        self._begun = False

    def restart(self) -> None:
        """Let the next tensions be the first ones, at which the cables rest."""
        self._begun = False

    def torque(self, bar: Array, frame: Array, tensions: Array) -> Array:
        """Return torques (n,) [N·m] for reference rows (19,) and wanted tensions (n,) [N]."""
        if not self._begun:
            self.first[:], self._begun = tensions, True
            _rest(self.cables, self.tables, bar, frame, tensions, self.memory)
        torque = np.empty(len(tensions))
        winch_torque(
            *(bar, frame, tensions, self.cables, self.tables),
            *(self.numbers, self.memory, self.first, torque),
        )
        return torque


@njit(cache=True, error_model="numpy")
def winch_torque(
    bar: Array,
    frame: Array,
    tensions: Array,
    cables: Array,
    tables: Array,
    numbers: Array,
    memory: Array,
    first: Array,
    out: Array,
) -> None:
    """Write what `WinchFeedforward.torque` returns from the second call on; advance the memory.

    Args:
        bar: reference row (19,), as that of `frame`.
        frame: of the winch frame.
        tensions: wanted, (n,) [N].
        cables: parameter rows.
        tables: of the stiffness law.
        numbers: share of a new value in each filter, 0 without filters, and the period [s].
        memory: per cable, (n, MEMORY).
        first: tensions of the first step, (n,) [N].
        out: torques, (n,) [N·m].
    """
    n = len(tensions)
    lengths, winding, stretching = np.empty(n), np.empty(n), np.zeros(n)
    winding_accelerations(cables, bar, frame, lengths, winding)
    if numbers[FRESH] > 0.0:
        _stretch(cables, tables, lengths, tensions, numbers, memory, stretching)
    for i in range(n):
        radius, inertia = cables[i, RADIUS], cables[i, INERTIA]
        share = lengths[i] / (lengths[i] - memory[i, ELONGATION])
        moved = inertia / radius * share * (stretching[i] + winding[i])
        out[i] = radius * (tensions[i] - first[i]) + moved


@njit(cache=True, error_model="numpy")
def winding_accelerations(
    cables: Array, bar: Array, frame: Array, lengths: Array, winding: Array
) -> None:
    """Write lengths l (n,) [m] and −l̈ (n,) [m/s²] for reference rows (19,) of bar and frame.

    With the ends' relative velocity w and acceleration: l̈ = u·ẇ + (w·w − l̇²)/l.
    """
    base = _placement(frame)
    spans = np.empty((cables.shape[0], SPAN_COLUMNS))
    cable_spans(cables, base, _placement(bar), spans)
    for i in range(cables.shape[0]):
        lengths[i] = spans[i, LENGTH]
        if cables[i, ROUTE + STOP_COUNT] > 0.0:
            winding[i] = _over_route(cables[i : i + 1], bar, frame)
            continue
        if cables[i, PULLEY_RADIUS] > 0.0:
            winding[i] = _over_pulley(cables[i], spans[i], bar, frame, base[1])
            continue
        exit_arm = rotate(base[1], cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2])
        arm = spans[i, ARM], spans[i, ARM + 1], spans[i, ARM + 2]
        (vx, vy, vz), (ax, ay, az) = _point_motion(bar, arm)
        (wx, wy, wz), (bx, by, bz) = _point_motion(frame, exit_arm)
        ux, uy, uz = spans[i, DIRECTION], spans[i, DIRECTION + 1], spans[i, DIRECTION + 2]
        parts = cables[i, PARTS]
        squared = parts * parts * ((vx - wx) ** 2 + (vy - wy) ** 2 + (vz - wz) ** 2)
        along = ux * (ax - bx) + uy * (ay - by) + uz * (az - bz)
        winding[i] = -along - (squared - spans[i, RATE] ** 2) / lengths[i]


@njit(cache=True, error_model="numpy")
def _over_pulley(cable: Array, span: Array, bar: Array, frame: Array, rotation: Matrix) -> float:
    """Return −l̈ [m/s²] of a cable over a pulley.

    With the attachment's velocity w and acceleration against the frame: l̈ = u·ẇ + u̇·w.
    """
    arm = span[ARM], span[ARM + 1], span[ARM + 2]
    ax, ay, az = rotate(rotation, cable[EXIT], cable[EXIT + 1], cable[EXIT + 2])
    rx, ry, rz = bar[0] + arm[0] - frame[0], bar[1] + arm[1] - frame[1], bar[2] + arm[2] - frame[2]
    (vx, vy, vz), (px, py, pz) = _point_motion(bar, arm)
    (ex, ey, ez), (qx, qy, qz) = _point_motion(frame, (rx, ry, rz))
    wx, wy, wz = vx - ex, vy - ey, vz - ez
    cx, cy, cz = cross(frame[10], frame[11], frame[12], wx, wy, wz)
    axis = rotate(rotation, cable[PULLEY_AXIS], cable[PULLEY_AXIS + 1], cable[PULLEY_AXIS + 2])
    apart = rx - ax, ry - ay, rz - az
    tx, ty, tz = pulley_turning(apart, axis, cable[PULLEY_RADIUS], (wx, wy, wz))
    along = (
        span[DIRECTION] * (px - qx - 2.0 * cx)
        + span[DIRECTION + 1] * (py - qy - 2.0 * cy)
        + span[DIRECTION + 2] * (pz - qz - 2.0 * cz)
    )
    return -along - cable[PARTS] * (tx * wx + ty * wy + tz * wz)


@njit(cache=True, error_model="numpy")
def _over_route(cable: Array, bar: Array, frame: Array) -> float:
    """Return −l̈ [m/s²] of a cable with a route, as a central difference of l̇; its row (1, …)."""
    spans = np.empty((2, SPAN_COLUMNS))
    for side, time in enumerate((-_STEP, _STEP)):
        base, body = _moved(frame, time), _moved(bar, time)
        cable_spans(cable, base, body, spans[side : side + 1])
    return (spans[0, RATE] - spans[1, RATE]) / (2.0 * _STEP)


@njit(cache=True, error_model="numpy")
def _moved(row: Array, time: float) -> Placement:
    """Return a body's placement a little later, or earlier, than in a reference row.

    What is left out is of second order in time, alike on both sides.
    """
    (px, py, pz), turn, (vx, vy, vz), (wx, wy, wz) = _placement(row)
    # R + t·ω × R, column by column.
    ax, ay, az = cross(wx, wy, wz, turn[0], turn[3], turn[6])
    bx, by, bz = cross(wx, wy, wz, turn[1], turn[4], turn[7])
    cx, cy, cz = cross(wx, wy, wz, turn[2], turn[5], turn[8])
    turned = (
        *(turn[0] + time * ax, turn[1] + time * bx, turn[2] + time * cx),
        *(turn[3] + time * ay, turn[4] + time * by, turn[5] + time * cy),
        *(turn[6] + time * az, turn[7] + time * bz, turn[8] + time * cz),
    )
    return (
        (px + time * vx, py + time * vy, pz + time * vz),
        turned,
        (vx + time * row[13], vy + time * row[14], vz + time * row[15]),
        (wx + time * row[16], wy + time * row[17], wz + time * row[18]),
    )


@njit(cache=True, error_model="numpy")
def _placement(row: Array) -> Placement:
    """Return position, rotation, velocity and spin of a reference row."""
    roll, pitch, yaw = euler_from_quaternion(row[3:7])
    rotation = rotation_from_euler(roll, pitch, yaw)
    return (row[0], row[1], row[2]), rotation, (row[7], row[8], row[9]), (row[10], row[11], row[12])


@njit(cache=True, error_model="numpy")
def _point_motion(row: Array, arm: Vector) -> tuple[Vector, Vector]:
    """Return velocity and acceleration of a body's point, in world axes as the arm to it."""
    spin, spin_rate = (row[10], row[11], row[12]), (row[16], row[17], row[18])
    rx, ry, rz = cross(*spin, *arm)
    cx, cy, cz = cross(*spin, rx, ry, rz)
    tx, ty, tz = cross(*spin_rate, *arm)
    velocity = row[7] + rx, row[8] + ry, row[9] + rz
    return velocity, (row[13] + tx + cx, row[14] + ty + cy, row[15] + tz + cz)


@njit(cache=True, error_model="numpy")
def _rest(
    cables: Array, tables: Array, bar: Array, frame: Array, tensions: Array, memory: Array
) -> None:
    """Write the memory of cables that have long carried these tensions."""
    n = len(tensions)
    lengths, winding = np.empty(n), np.empty(n)
    winding_accelerations(cables, bar, frame, lengths, winding)
    for i in range(n):
        elongation = FIRST_ELONGATION
        for _ in range(NEWTON_STEPS):
            elastic = lengths[i] - elongation + cables[i, OFFSET_LENGTH]
            scale = law_scale(elastic, cables, i)
            found, slope = elastic_tension(elongation, elastic, scale, cables, tables, i)
            elongation = max(LEAST_ELONGATION, elongation + (tensions[i] - found) / slope)
        memory[i, ONCE] = memory[i, TWICE] = tensions[i]
        memory[i, ELONGATION], memory[i, STRETCHING] = elongation, 0.0


@njit(cache=True, error_model="numpy")
def _stretch(
    cables: Array,
    tables: Array,
    lengths: Array,
    tensions: Array,
    numbers: Array,
    memory: Array,
    out: Array,
) -> None:
    """Advance the memory by one step, implicitly, and write ε̈ (n,) [m/s²]."""
    fresh, period = numbers[FRESH], numbers[PERIOD]
    for i in range(len(tensions)):
        cable = memory[i]
        cable[ONCE] += fresh * (tensions[i] - cable[ONCE])
        cable[TWICE] += fresh * (cable[ONCE] - cable[TWICE])
        elastic = lengths[i] - cable[ELONGATION] + cables[i, OFFSET_LENGTH]
        scale = law_scale(elastic, cables, i)
        damping = max(0.0, cables[i, DAMPING_CONSTANT] - cables[i, DAMPING_SLOPE] * elastic)
        carried, slope = elastic_tension(cable[ELONGATION], elastic, scale, cables, tables, i)
        speed = (cable[TWICE] - carried) / (damping + slope * period)
        out[i] = (speed - cable[STRETCHING]) / period
        cable[STRETCHING] = speed
        cable[ELONGATION] = max(LEAST_ELONGATION, cable[ELONGATION] + period * speed)
