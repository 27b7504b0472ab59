"""Tension distributions by linear algebra alone.

All share one signature: structure A (m, n) with A·t = w, wrench w (m,), limits (n, 2) [N], weights
and memory (unused), tensions out (n,) [N]. The tensions may be beyond the limits; whoever asks
limits each by itself. They return 0, or −1, nothing written, where A has no full row rank.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.cholesky import solve_gram

Array = NDArray[np.float64]

# The thesis's recommendation (chapter 8).
MOST_REMOVED = 3
# Round-off of a solution, as a share of the limits' range.
SLACK = 1e-9


@njit(cache=True, error_model="numpy")
def pseudo_inverse(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write t = A⁺w, thesis (5-1)."""
    if not nearest_tensions(structure, wrench, np.zeros(len(out)), np.ones(len(out)), out):
        return -1
    return 0


@njit(cache=True, error_model="numpy")
def closed_form(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write t = tₘ + A⁺(w − A·tₘ), tₘ amid the limits; Pott, Bruckmann, Mikelsons 2009."""
    middle = 0.5 * (limits[:, 0] + limits[:, 1])
    if not nearest_tensions(structure, wrench, middle, np.ones(len(out)), out):
        return -1
    return 0


@njit(cache=True, error_model="numpy")
def improved_closed_form(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write the closed form, the cable furthest beyond its limits held there, again and again.

    As many are held as the null space has dimensions; Pott 2014, "An improved force distribution
    algorithm for over-constrained cable-driven parallel robots".
    """
    n, free = len(out), np.ones(len(out))
    held = 0.5 * (limits[:, 0] + limits[:, 1])
    if not nearest_tensions(structure, wrench, held, free, out):
        return -1
    tensions = out.copy()
    for _ in range(n - len(wrench)):
        worst, beyond = -1, 0.0
        for i in range(n):
            low, high = limits[i, 0] - tensions[i], tensions[i] - limits[i, 1]
            if free[i] > 0.0 and max(low, high) > max(beyond, SLACK * (limits[i, 1])):
                worst, beyond = i, max(low, high)
        if worst < 0:
            break
        held[worst] = limits[worst, 0] if tensions[worst] < limits[worst, 0] else limits[worst, 1]
        free[worst] = 0.0
        if not nearest_tensions(structure, wrench, held, free, tensions):
            break
        out[:] = tensions
    return 0


@njit(cache=True, error_model="numpy")
def removal(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write the pseudo-inverse of all cables but up to three, which stay at their lower limit.

    The fewest are removed that leave all tensions within the limits, and of as many those that
    leave the least sum of squares. Where none do, it is the limited pseudo-inverse of all.
    """
    if not nearest_tensions(structure, wrench, np.zeros(len(out)), np.ones(len(out)), out):
        return -1
    if _within(limits, out):
        return 0
    n, best, tensions = len(out), out.copy(), np.empty(len(out))
    free = np.empty(n)
    for count in range(1, min(MOST_REMOVED, n - len(wrench)) + 1):
        least = np.inf
        for chosen in range(1 << n):
            removed = 0
            for i in range(n):
                free[i] = 1.0 - ((chosen >> i) & 1)
                removed += (chosen >> i) & 1
            if removed != count:
                continue
            held = np.where(free > 0.0, 0.0, limits[:, 0])
            if not nearest_tensions(structure, wrench, held, free, tensions):
                continue
            if _within(limits, tensions) and (tensions**2).sum() < least:
                least = (tensions**2).sum()
                best[:] = tensions
        if least < np.inf:
            break
    out[:] = best
    return 0


@njit(cache=True, error_model="numpy")
def nearest_tensions(
    structure: Array, wrench: Array, start: Array, free: Array, out: Array
) -> bool:
    """Write the tensions nearest to `start` with A·t = w, of which only the free ones differ.

    Returns False, with `out` as it was, where the free columns have no full row rank.
    """
    m, n = structure.shape
    columns, multipliers = np.empty((m, n)), np.empty(m)
    for row in range(m):
        given = 0.0
        for i in range(n):
            columns[row, i] = structure[row, i] * free[i]
            given += structure[row, i] * start[i]
        multipliers[row] = wrench[row] - given
    if not solve_gram(columns, multipliers):
        return False
    for i in range(n):
        change = 0.0
        for row in range(m):
            change += columns[row, i] * multipliers[row]
        out[i] = start[i] + change
    return True


@njit(cache=True, error_model="numpy")
def _within(limits: Array, tensions: Array) -> bool:
    for i in range(len(tensions)):
        slack = SLACK * limits[i, 1]
        if not limits[i, 0] - slack <= tensions[i] <= limits[i, 1] + slack:
            return False
    return True


@njit(cache=True, error_model="numpy")
def limit_tensions(limits: Array, tensions: Array) -> int:
    """Limit each tension to its range; return how many were beyond it."""
    limited = 0
    for i in range(len(tensions)):
        tension = tensions[i]
        tensions[i] = min(limits[i, 1], max(limits[i, 0], tension))
        limited += tensions[i] != tension
    return limited
