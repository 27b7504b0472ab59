"""The analytic centre of all tension sets that give a wrench, or the nearest wrench."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.cholesky import factorise, substitute

Array = NDArray[np.float64]

# Weight of the barrier beside a squared newton: the wrench is missed by this [N²] over the
# distance of the tensions from their limits.
BARRIER = 1e-10
CENTRED = 1e-6
MOST_ITERATIONS = 50
# Share of the way to the nearest limit that one step may go.
STEP_SHARE = 0.995
# A tension this near its limit stands at it [N].
AT_LIMIT = 1e-6


@njit(cache=True, error_model="numpy")
def analytic_centre(
    structure: Array, wrench: Array, limits: Array, weights: Array, out: Array
) -> int:
    """Write the tensions that are the least ½Σ Wᵢ(A·t − w)ᵢ² − μΣ log((t − t_min)(t_max − t)).

    For μ → 0 that is the analytic centre of {t: A·t = w, t_min < t < t_max}, a smooth function of
    pose and wrench, where the set is not empty; else the tensions of the nearest wrench. One
    smooth problem covers both, so that the tensions are continuous across the border. Solved from
    amid the limits by a primal-dual interior-point method with Mehrotra's steps (Nocedal, Wright,
    Numerical Optimization, 16.6).

    Args:
        structure: A (m, n).
        wrench: w (m,) [N, N·m].
        limits: (n, 2) [N], lower below upper.
        weights: W (m,), > 0.
        out: tensions (n,) [N].

    Returns:
        How many tensions stand at a limit.
    """
    n, m = len(out), len(wrench)
    low, high = 0.5 * (limits[:, 1] - limits[:, 0]), 0.5 * (limits[:, 1] - limits[:, 0])
    tensions, multipliers = limits[:, 0] + low, np.zeros(m)
    press_low, press_high = 1.0 / low, 1.0 / high
    move, dual = np.zeros(n), np.empty(m)
    move_low, move_high = np.zeros(n), np.zeros(n)
    matrix, rows, scale = np.empty((m, m)), np.empty((m, n)), np.empty(n)
    for _ in range(MOST_ITERATIONS):
        gradient, gap = press_high - press_low, np.empty(m)
        for row in range(m):
            gap[row] = (
                (structure[row] * tensions).sum() - wrench[row] - multipliers[row] / weights[row]
            )
            gradient += structure[row] * multipliers[row]
        complement = ((low * press_low).sum() + (high * press_high).sum()) / (2 * n)
        off = max(
            np.abs(low * press_low / BARRIER - 1.0).max(),
            np.abs(high * press_high / BARRIER - 1.0).max(),
        )
        if off < CENTRED and np.abs(gap).max() < CENTRED * np.sqrt(BARRIER):
            break
        scale[:] = press_low / low + press_high / high
        for i in range(m):
            rows[i] = structure[i] / scale
            for j in range(i + 1):
                matrix[i, j] = (rows[i] * structure[j]).sum()
            matrix[i, i] += 1.0 / weights[i]
        if not factorise(matrix):
            break
        target = 0.0
        for corrector in range(2):
            # Second-order terms help on the way, not at its end.
            second = 1.0 if corrector == 1 and target > BARRIER else 0.0
            centre_low = (target - second * move * move_low) / low - press_low
            centre_high = (target + second * move * move_high) / high - press_high
            force = centre_low - centre_high - gradient
            for row in range(m):
                dual[row] = (rows[row] * force).sum() + gap[row]
            substitute(matrix, dual)
            move[:] = force
            for row in range(m):
                move -= structure[row] * dual[row]
            move /= scale
            move_low[:] = centre_low - press_low * move / low
            move_high[:] = centre_high + press_high * move / high
            share = min(
                _reach(low, move), _reach(high, -move), _reach(press_low, move_low)
            )
            share = min(share, _reach(press_high, move_high))
            if corrector == 0:
                share = min(1.0, share)
                ahead = ((low + share * move) * (press_low + share * move_low)).sum()
                ahead += ((high - share * move) * (press_high + share * move_high)).sum()
                target = max(BARRIER, (ahead / (2 * n * complement)) ** 3 * complement)
        share = min(1.0, STEP_SHARE * share)
        tensions += share * move
        low += share * move
        high -= share * move
        multipliers += share * dual
        press_low += share * move_low
        press_high += share * move_high
    at_limit = 0
    for i in range(n):
        out[i] = min(limits[i, 1], max(limits[i, 0], tensions[i]))
        at_limit += min(low[i], high[i]) < AT_LIMIT
    return at_limit


@njit(cache=True, error_model="numpy")
def _reach(values: Array, move: Array) -> float:
    """Return how many times `move` may be added before a value is 0."""
    reach = np.inf
    for i in range(len(values)):
        if move[i] < 0.0:
            reach = min(reach, -values[i] / move[i])
    return reach
