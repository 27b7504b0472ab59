"""The thesis's workspace algorithms 1 and 2, pose by pose.

They run over millions of poses; compiled, and without a lock, so that threads share the work.
Poses are the product of positions and orientations, orientations fastest.
"""

from __future__ import annotations

from math import isfinite, nan, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.cable import EXIT, PARTS, PULLEY_AXIS, PULLEY_RADIUS, ROUTE, routed
from cspm_model.kernels.pulley import around_pulley
from cspm_model.kernels.rotation import Placement
from cspm_model.kernels.route import STOP_COUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

# A pivot below this share of the largest entry: the columns are no basis.
SMALLEST_PIVOT = 1e-9
# Share of the wanted wrench that a tension may be beyond its limit, for round-off.
ROUND_OFF = 1e-9
# The winch frame is at the origin.
_STILL = (0.0, 0.0, 0.0)
_FRAME = (_STILL, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), _STILL, _STILL)


@njit(cache=True, error_model="numpy", nogil=True)
def _placement(place: Array, turn: Array) -> Placement:
    """Return a bar at rest."""
    rotation = (
        *(turn[0], turn[1], turn[2]),
        *(turn[3], turn[4], turn[5]),
        *(turn[6], turn[7], turn[8]),
    )
    return (place[0], place[1], place[2]), rotation, _STILL, _STILL


@njit(cache=True, error_model="numpy", nogil=True)
def structure(
    position: Array, turn: Array, arms: Array, cables: Array, axes: Integers, out: Array
) -> bool:
    """Write −Jᵀ of (2-13), rows `axes` of force and moment in world axes, to `out` (m, n).

    False, with NaN in all of `out`, where a cable has no direction: its attachment is at its exit
    or inside its pulley, where no machine can be.

    Args:
        position: of the bar, (3,) [m].
        turn: the bar's rotation, row by row, (9,).
        arms: from the bar's origin to the attachments, world axes, (n, 3) [m].
        cables: parameter rows, see `cspm_model.kernels.cable`.
        axes: rows that are written, (m,).
        out: (m, n).
    """
    for i in range(arms.shape[0]):
        bx, by, bz = arms[i, 0], arms[i, 1], arms[i, 2]
        x = position[0] + bx - cables[i, EXIT]
        y = position[1] + by - cables[i, EXIT + 1]
        z = position[2] + bz - cables[i, EXIT + 2]
        scale = -cables[i, PARTS]
        cx = cy = cz = 0.0
        if cables[i, ROUTE + STOP_COUNT] > 0.0:
            body = _placement(position, turn)
            _, (x, y, z), (cx, cy, cz) = routed(cables, i, _FRAME, body, (bx, by, bz))
        elif cables[i, PULLEY_RADIUS] > 0.0:
            axis = cables[i, PULLEY_AXIS], cables[i, PULLEY_AXIS + 1], cables[i, PULLEY_AXIS + 2]
            _, (x, y, z) = around_pulley((x, y, z), axis, cables[i, PULLEY_RADIUS])
        else:
            scale = scale / sqrt(x * x + y * y + z * z)
        x, y, z = x * scale, y * scale, z * scale
        if not isfinite(x + y + z):
            out[:] = nan
            return False
        column = (
            *(x, y, z),
            *(by * z - bz * y - cx, bz * x - bx * z - cy, bx * y - by * x - cz),
        )
        for row in range(axes.shape[0]):
            out[row, i] = column[axes[row]]
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def all_structures(
    positions: Array, turns: Array, arms: Array, cables: Array, axes: Integers, out: Array
) -> None:
    """Write `structure` of all poses to `out` (P·Q, m, n); NaN where a cable has no direction."""
    count = arms.shape[0]
    for pose in range(out.shape[0]):
        place, k = positions[pose // count], pose % count
        structure(place, turns[k], arms[k], cables, axes, out[pose])


@njit(cache=True, error_model="numpy", nogil=True)
def solve(system: Array) -> bool:
    """Solve A·x = b in `system` = [A | b] (m, m + 1), which is destroyed; x replaces b.

    Gauss's elimination with partial pivoting; False, with no x, where A is singular. A library's
    solver takes ten times as long for so small a system.
    """
    m = system.shape[0]
    largest = 0.0
    for i in range(m):
        for j in range(m):
            largest = max(largest, abs(system[i, j]))
    for k in range(m):
        pivot = k
        for i in range(k + 1, m):
            if abs(system[i, k]) > abs(system[pivot, k]):
                pivot = i
        if abs(system[pivot, k]) <= SMALLEST_PIVOT * largest:
            return False
        for j in range(k, m + 1):
            system[k, j], system[pivot, j] = system[pivot, j], system[k, j]
        inverse = 1.0 / system[k, k]
        for i in range(k + 1, m):
            factor = system[i, k] * inverse
            for j in range(k + 1, m + 1):
                system[i, j] -= factor * system[k, j]
    for i in range(m - 1, -1, -1):
        rest = system[i, m]
        for j in range(i + 1, m):
            rest -= system[i, j] * system[j, m]
        system[i, m] = rest / system[i, i]
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def pseudo_inverse_holds(
    first: int,
    last: int,
    positions: Array,
    turns: Array,
    arms: Array,
    cables: Array,
    axes: Integers,
    wrenches: Array,
    most: Array,
    out: Mask,
) -> None:
    """Write whether the pseudo-inverse's tensions lie in [0, most], Algorithm 1, to `out`.

    Args:
        first: the first pose of all.
        last: the one after the last.
        positions: (P, 3) [m].
        turns: rotations, row by row, (Q, 9).
        arms: (Q, n, 3) [m], one set per orientation.
        cables: parameter rows, see `cspm_model.kernels.cable`.
        axes: rows of the wrench that are to be met, (m,).
        wrenches: wanted of the cables, (Q, m) [N, N·m].
        most: highest tensions (n,) [N].
        out: (P·Q,).
    """
    n, m, count = arms.shape[1], axes.shape[0], arms.shape[0]
    rows, system = np.empty((m, n)), np.empty((m, m + 1))
    for pose in range(first, last):
        place, at = positions[pose // count], pose % count
        wrench = wrenches[at]
        out[pose] = structure(place, turns[at], arms[at], cables, axes, rows)
        if not out[pose]:
            continue
        size = 0.0
        for i in range(m):
            size = max(size, abs(wrench[i]))
            for j in range(i + 1):
                total = 0.0
                for cable in range(n):
                    total += rows[i, cable] * rows[j, cable]
                system[i, j] = total
                system[j, i] = total
            system[i, m] = wrench[i]
        held = solve(system)
        for cable in range(n):
            tension = 0.0
            for i in range(m):
                tension += rows[i, cable] * system[i, m]
            slack = ROUND_OFF * size
            held = held and -slack <= tension <= most[cable] + slack
        out[pose] = held


@njit(cache=True, error_model="numpy", nogil=True)
def general_holds(
    first: int,
    last: int,
    positions: Array,
    turns: Array,
    arms: Array,
    cables: Array,
    axes: Integers,
    wrenches: Array,
    most: Array,
    bases: Integers,
    out: Mask,
) -> None:
    """Write whether any basis of cables holds the wrench with tensions in [0, most], Algorithm 2.

    Args:
        first: the first pose of all.
        last: the one after the last.
        positions: (P, 3) [m].
        turns: rotations, row by row, (Q, 9).
        arms: (Q, n, 3) [m], one set per orientation.
        cables: parameter rows, see `cspm_model.kernels.cable`.
        axes: rows of the wrench that are to be met, (m,).
        wrenches: wanted of the cables, (Q, m) [N, N·m].
        most: highest tensions (n,) [N].
        bases: which m cables, each not removed, (K, m).
        out: (P·Q,).
    """
    n, m, count = arms.shape[1], axes.shape[0], arms.shape[0]
    rows, system = np.empty((m, n)), np.empty((m, m + 1))
    # The basis that held the last pose likely holds its neighbour.
    start = 0
    for pose in range(first, last):
        place, at = positions[pose // count], pose % count
        wrench = wrenches[at]
        out[pose] = structure(place, turns[at], arms[at], cables, axes, rows)
        if not out[pose]:
            continue
        size = 0.0
        for i in range(m):
            size = max(size, abs(wrench[i]))
        held = False
        for k in range(bases.shape[0]):
            basis = bases[(start + k) % bases.shape[0]]
            for i in range(m):
                for j in range(m):
                    system[i, j] = rows[i, basis[j]]
                system[i, m] = wrench[i]
            held = solve(system)
            slack = ROUND_OFF * size
            for j in range(m):
                held = held and -slack <= system[j, m] <= most[basis[j]] + slack
            if held:
                start = (start + k) % bases.shape[0]
                break
        out[pose] = held
