"""Velocity and acceleration of a body from measured poses."""

from __future__ import annotations

from math import exp, pi

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.rotation import euler_from_quaternion

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

# What is counted: steps from one pose to the next, steps since the last new one, and whether any
# pose came.
STEPS_PER_POSE, AGE, STARTED = 0, 1, 2


class TargetFilter:
    """A filter of third order per coordinate of x y z φ θ ψ, with three poles at its bandwidth.

    Between poses it goes on with constant acceleration; a pose corrects position, velocity and
    acceleration by shares of what it surprises by (critically damped α-β-γ filter, that is the
    fading-memory filter of degree 2, Brookner 1998). Without noise a coordinate of frequency ω is
    wrong by the share (ω/ω_b)³ of itself, far below the bandwidth ω_b. Poses count as of when they
    come: a delay shows as a lag.

    Attributes:
        gains: what position, velocity and acceleration take of a surprise, (3,).
        period: time between steps [s], (1,).
        last: the last new pose row, (7,).
        counts: see `STEPS_PER_POSE`.
        motion: coordinates and their first two derivatives, (3, 6).
    """

    def __init__(self, bandwidth: float, *, period: float, steps_per_pose: int) -> None:
        """Make the filter.

        Args:
            bandwidth: ω_b [rad/s].
            period: time between steps [s].
            steps_per_pose: steps from one pose to the next, ≥ 1.
        """
        self.gains = _gains(bandwidth, period * steps_per_pose)
        self.period = np.array([period])
        self.last = np.full(7, np.nan)
        self.counts = np.array([steps_per_pose, 0, 0], dtype=np.int64)
        self.motion: Array = np.zeros((3, 6))

    def step(self, pose: Array) -> Array:
        """Return coordinates and their first two derivatives, (3, 6), for the latest pose row (7,).

        Angles go on past ±π where the body turns on.
        """
        follow_target(pose, self.gains, self.period[0], self.last, self.counts, self.motion)
        return self.motion.copy()


@njit(cache=True, error_model="numpy", _nrt=False)
def follow_target(
    pose: Array, gains: Array, period: float, last: Array, counts: Counts, motion: Array
) -> None:
    """Advance `motion` (3, 6) by one period and correct it by a pose row (7,) where that is new.

    `last` (7,) is the last new pose; `counts` see `STEPS_PER_POSE`.
    """
    counts[AGE] += 1
    # A pose that stays the same for longer than its period is a new one all the same.
    fresh = counts[AGE] >= counts[STEPS_PER_POSE]
    for i in range(7):
        if pose[i] != last[i]:
            fresh = True
    if fresh:
        counts[AGE] = 0
        for i in range(7):
            last[i] = pose[i]
    angles = euler_from_quaternion(pose[3:7])
    for d in range(6):
        measured = pose[d] if d < 3 else angles[d - 3]
        if counts[STARTED] == 0:
            motion[0, d], motion[1, d], motion[2, d] = measured, 0.0, 0.0
            continue
        motion[0, d] += period * motion[1, d] + 0.5 * period**2 * motion[2, d]
        motion[1, d] += period * motion[2, d]
        if fresh:
            surprise = measured - motion[0, d]
            if d >= 3:
                surprise = (surprise + pi) % (2.0 * pi) - pi
            for order in range(3):
                motion[order, d] += gains[order] * surprise
    counts[STARTED] = 1


def _gains(bandwidth: float, period: float) -> Array:
    """Return what position, velocity and acceleration take of a surprise, every `period` [s]."""
    fade = exp(-bandwidth * period)
    return np.array(
        [
            1.0 - fade**3,
            1.5 * (1.0 - fade) ** 2 * (1.0 + fade) / period,
            (1.0 - fade) ** 3 / period**2,
        ]
    )
