"""The analytic centre of all tension sets that give a wrench, or the nearest wrench."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.cholesky import factorise, substitute

Array = NDArray[np.float64]

# Weight μ of the barrier beside a squared newton: the wrench is missed by μ [N²] over the distance
# of the tensions from their limits.
BARRIER = 1e-10
CENTRED = 1e-6
MOST_ITERATIONS = 50
# From the last solution Newton's method takes two or three steps, each of them whole. Where one is
# shorter than this share, limits come or go: steps from amid the limits are fewer then.
MOST_NEWTON_STEPS, LEAST_SHARE = 5, 0.5
# Share of the way to the nearest limit that one step may go.
STEP_SHARE = 0.995
# A tension this near its limit stands at it [N].
AT_LIMIT = 1e-6

# Rows of the iterate (n): tension, its distances from both limits, and the multipliers of these.
TENSION, LOW, HIGH, PRESS_LOW, PRESS_HIGH = 0, 1, 2, 3, 4


def centre_memory(m: int, n: int) -> Array:
    """Return the memory of `analytic_centre` for A of shape (m, n), with nothing in it."""
    return np.zeros(1 + 5 * n + m)


@njit(cache=True, error_model="numpy")
def analytic_centre(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write the tensions that are the least ½Σ Wᵢ(A·t − w)ᵢ² − μΣ log((t − t_min)(t_max − t)).

    For μ → 0 that is the analytic centre of {t: A·t = w, t_min < t < t_max}, a smooth function of
    pose and wrench, where the set is not empty; else the tensions of the nearest wrench. One
    smooth problem covers both, so that the tensions are continuous across the border. Solved by
    Newton's method on the primal-dual equations from the last solution, as a control loop changes
    little from step to step; where that does not converge at once, from amid the limits by an
    interior-point method with Mehrotra's steps (Nocedal, Wright, Numerical Optimization, 16.6).

    Args:
        structure: A (m, n).
        wrench: w (m,) [N, N·m].
        limits: (n, 2) [N], lower below upper.
        weights: W (m,), > 0.
        memory: of `centre_memory`, of the last solution; empty: none is kept.
        out: tensions (n,) [N].

    Returns:
        How many tensions stand at a limit.
    """
    m, n = structure.shape
    iterate, multipliers = np.empty((5, n)), np.empty(m)
    keeps, found = memory.shape[0] > 0, False
    if keeps and _remembered(memory, iterate, multipliers):
        found = _newton(structure, wrench, weights, iterate, multipliers)
    if not found:
        _amid(limits, iterate, multipliers)
        _predict_and_correct(structure, wrench, weights, iterate, multipliers)
    if keeps:
        _remember(memory, iterate, multipliers)
    at_limit = 0
    for i in range(n):
        out[i] = min(limits[i, 1], max(limits[i, 0], iterate[TENSION, i]))
        at_limit += min(iterate[LOW, i], iterate[HIGH, i]) < AT_LIMIT
    return at_limit


@njit(cache=True, error_model="numpy", _nrt=False)
def _remembered(memory: Array, iterate: Array, multipliers: Array) -> bool:
    """Read the last solution; return whether there is one."""
    n = iterate.shape[1]
    for i in range(5 * n):
        iterate[i // n, i % n] = memory[1 + i]
    for row in range(multipliers.shape[0]):
        multipliers[row] = memory[1 + 5 * n + row]
    return memory[0] > 0.0


@njit(cache=True, error_model="numpy", _nrt=False)
def _remember(memory: Array, iterate: Array, multipliers: Array) -> None:
    n = iterate.shape[1]
    memory[0] = 1.0
    for i in range(5 * n):
        memory[1 + i] = iterate[i // n, i % n]
    for row in range(multipliers.shape[0]):
        memory[1 + 5 * n + row] = multipliers[row]


@njit(cache=True, error_model="numpy", _nrt=False)
def _amid(limits: Array, iterate: Array, multipliers: Array) -> None:
    for i in range(iterate.shape[1]):
        half = 0.5 * (limits[i, 1] - limits[i, 0])
        iterate[TENSION, i] = limits[i, 0] + half
        iterate[LOW, i] = iterate[HIGH, i] = half
        iterate[PRESS_LOW, i] = iterate[PRESS_HIGH, i] = 1.0 / half
    for row in range(multipliers.shape[0]):
        multipliers[row] = 0.0


@njit(cache=True, error_model="numpy")
def _newton(
    structure: Array, wrench: Array, weights: Array, iterate: Array, multipliers: Array
) -> bool:
    """Go on from a solution of another problem; return whether this one's was found."""
    m, n = structure.shape
    move, scratch = np.zeros((5, n)), np.empty((4, n))
    dual, gap, matrix = np.empty(m), np.empty(m), np.empty((m, m))
    for _ in range(MOST_NEWTON_STEPS):
        largest = _look(structure, wrench, weights, iterate, multipliers, gap, scratch)
        _, off = _complement(iterate)
        if off < CENTRED and largest < CENTRED * np.sqrt(BARRIER):
            return True
        _normal_matrix(structure, weights, scratch[0], matrix)
        if not factorise(matrix):
            return False
        _direction(structure, iterate, matrix, gap, BARRIER, 0.0, scratch, dual, move)
        share = min(1.0, STEP_SHARE * _reach(iterate, move))
        if share < LEAST_SHARE:
            return False
        _go(share, move, dual, iterate, multipliers)
    return False


@njit(cache=True, error_model="numpy")
def _predict_and_correct(
    structure: Array, wrench: Array, weights: Array, iterate: Array, multipliers: Array
) -> None:
    """Go from amid the limits to the solution."""
    m, n = structure.shape
    move, scratch = np.zeros((5, n)), np.empty((4, n))
    dual, gap, matrix = np.zeros(m), np.zeros(m), np.empty((m, m))
    for _ in range(MOST_ITERATIONS):
        largest = _look(structure, wrench, weights, iterate, multipliers, gap, scratch)
        complement, off = _complement(iterate)
        if off < CENTRED and largest < CENTRED * np.sqrt(BARRIER):
            break
        _normal_matrix(structure, weights, scratch[0], matrix)
        if not factorise(matrix):
            break
        _direction(structure, iterate, matrix, gap, 0.0, 0.0, scratch, dual, move)
        share = min(1.0, _reach(iterate, move))
        ahead = _complement_ahead(iterate, move, share)
        target = max(BARRIER, (ahead / complement) ** 3 * complement)
        # Second-order terms help on the way, not at its end.
        second = 1.0 if target > BARRIER else 0.0
        _direction(structure, iterate, matrix, gap, target, second, scratch, dual, move)
        share = min(1.0, STEP_SHARE * _reach(iterate, move))
        _go(share, move, dual, iterate, multipliers)


@njit(cache=True, error_model="numpy", _nrt=False)
def _go(share: float, move: Array, dual: Array, iterate: Array, multipliers: Array) -> None:
    for row in range(5):
        for i in range(iterate.shape[1]):
            iterate[row, i] += share * move[row, i]
    for row in range(multipliers.shape[0]):
        multipliers[row] += share * dual[row]


@njit(cache=True, error_model="numpy")
def _look(
    structure: Array,
    wrench: Array,
    weights: Array,
    iterate: Array,
    multipliers: Array,
    gap: Array,
    scratch: Array,
) -> float:
    """Write 1/scale and gradient to `scratch` rows 0 and 1, what is missing to `gap` (m,).

    Returns the largest of it.
    """
    m, n = structure.shape
    for i in range(n):
        scratch[0, i] = 1.0 / (
            iterate[PRESS_LOW, i] / iterate[LOW, i] + iterate[PRESS_HIGH, i] / iterate[HIGH, i]
        )
        scratch[1, i] = iterate[PRESS_HIGH, i] - iterate[PRESS_LOW, i]
    largest = 0.0
    for row in range(m):
        found = -wrench[row] - multipliers[row] / weights[row]
        for i in range(n):
            found += structure[row, i] * iterate[TENSION, i]
            scratch[1, i] += structure[row, i] * multipliers[row]
        gap[row] = found
        largest = max(largest, abs(found))
    return largest


@njit(cache=True, error_model="numpy")
def _complement(iterate: Array) -> tuple[float, float]:
    """Return the mean of distance times multiplier, and how far any is from μ, as a share."""
    n = iterate.shape[1]
    total = off = 0.0
    for side in (1, 2):
        for i in range(n):
            product = iterate[side, i] * iterate[side + 2, i]
            total += product
            off = max(off, abs(product / BARRIER - 1.0))
    return total / (2 * n), off


@njit(cache=True, error_model="numpy")
def _complement_ahead(iterate: Array, move: Array, share: float) -> float:
    """Return the mean of distance times multiplier after a share of the move."""
    n = iterate.shape[1]
    total = 0.0
    for side in (1, 2):
        for i in range(n):
            distance = iterate[side, i] + share * move[side, i]
            total += distance * (iterate[side + 2, i] + share * move[side + 2, i])
    return total / (2 * n)


@njit(cache=True, error_model="numpy")
def _normal_matrix(structure: Array, weights: Array, inverse_scale: Array, out: Array) -> None:
    """Write the lower triangle of A·D⁻¹·Aᵀ + W⁻¹."""
    m, n = structure.shape
    for row in range(m):
        for column in range(row + 1):
            total = 0.0
            for i in range(n):
                total += structure[row, i] * inverse_scale[i] * structure[column, i]
            out[row, column] = total
        out[row, row] += 1.0 / weights[row]


@njit(cache=True, error_model="numpy")
def _direction(
    structure: Array,
    iterate: Array,
    factor: Array,
    gap: Array,
    target: float,
    second: float,
    scratch: Array,
    dual: Array,
    move: Array,
) -> None:
    """Write Newton's step to `move` and `dual`; rows 2 and 3 of `scratch` are its own.

    It aims at products of distance and multiplier that equal `target`, with the second-order terms
    of the step now in `move` taken `second` times.
    """
    m, n = structure.shape
    for i in range(n):
        bend = second * move[TENSION, i]
        scratch[2, i] = (target - bend * move[PRESS_LOW, i]) / iterate[LOW, i]
        scratch[3, i] = (target + bend * move[PRESS_HIGH, i]) / iterate[HIGH, i]
        scratch[2, i] -= iterate[PRESS_LOW, i]
        scratch[3, i] -= iterate[PRESS_HIGH, i]
        move[TENSION, i] = scratch[2, i] - scratch[3, i] - scratch[1, i]
    for row in range(m):
        dual[row] = gap[row]
        for i in range(n):
            dual[row] += structure[row, i] * scratch[0, i] * move[TENSION, i]
    substitute(factor, dual)
    for row in range(m):
        for i in range(n):
            move[TENSION, i] -= structure[row, i] * dual[row]
    for i in range(n):
        step = move[TENSION, i] * scratch[0, i]
        move[TENSION, i] = move[LOW, i] = step
        move[HIGH, i] = -step
        move[PRESS_LOW, i] = scratch[2, i] - iterate[PRESS_LOW, i] * step / iterate[LOW, i]
        move[PRESS_HIGH, i] = scratch[3, i] + iterate[PRESS_HIGH, i] * step / iterate[HIGH, i]


@njit(cache=True, error_model="numpy")
def _reach(iterate: Array, move: Array) -> float:
    """Return how many times the move may be made before a distance or multiplier is 0."""
    reach = np.inf
    for row in range(LOW, PRESS_HIGH + 1):
        for i in range(iterate.shape[1]):
            if move[row, i] < 0.0:
                reach = min(reach, -iterate[row, i] / move[row, i])
    return reach
