"""A sequence of minimum-jerk moves on knots.

Between knots at the moves' starts and ends a quintic spline is the minimum-jerk profile itself.
"""

from __future__ import annotations

from math import gcd

import numpy as np

from cspm_control.waves.realisation import checked_count, envelope
from cspm_control.waves.sea import Array
from cspm_msgs_py.motion_spec import TIME_GRID, Move


def move_knots(moves: tuple[Move, ...]) -> tuple[Array, float]:
    """Return the knots (n, 18) of a sequence of moves from t = 0, and their spacing [s].

    Raises:
        InputError: the sequence needs more knots than can be stored.
    """
    ticks = [(round(m.at / TIME_GRID), round(m.duration / TIME_GRID)) for m in moves]
    step = gcd(*(tick for pair in ticks for tick in pair))
    start, length = ticks[-1]
    count = checked_count((start + length) // step + 1)
    tick = np.linspace(0.0, (count - 1) * step, count)
    knots = np.zeros((count, 18))
    for move, (start, length) in zip(moves, ticks, strict=True):
        profile = envelope((tick - start) * TIME_GRID, length * TIME_GRID)
        knots += np.hstack([np.outer(values, move.by) for values in profile])
    return knots, step * TIME_GRID
