"""Biases of load cells, estimated from the balance of torques at their winches."""

from __future__ import annotations

from math import exp

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Both sides of the balance are smoothed with this band [rad/s], far above the waves.
BAND = 10.0
# What the balance leaves unexplained within the band [N], standard deviation.
UNEXPLAINED = 0.1
# Prior standard deviations of the drive's gain error and of the dry friction at the cable [N].
GAIN, DRY = 0.3, 1.0
# How far a bias wanders [N/√s].
WANDER = 0.003
# Motors slower than this [rad/s] do not show the sign of their dry friction.
CREEP = 0.05
BIAS, UNKNOWNS = 0, 3
# Numbers of the filters: the largest bias believed [N], the time between steps [s], what is left of
# the smoothed values after one, and the variance of a sample [N²].
LARGEST, PERIOD, FADE, NOISE = range(4)


class LoadCellBias:
    """A Kalman filter per cable for what its load cell says too much.

    A winch knows its cable's tension twice: from the load cell, and from J·q̈ = g·τ − r·t − f·sgn q̇
    (2-21) with its torque and its motor's speed. With the measured t + b for t,

        t + b − τ/r + (J/r)·q̈ = b + (g − 1)·τ/r − (f/r)·sgn q̇

    of which the left side is known. Bias, gain and friction differ in how they go with torque and
    direction, so that neither a drive that gives less than it says nor dry friction is taken for a
    bias once tension and direction have changed; before, the prior shares out what is seen.
    """

    def __init__(self, radii: Array, inertias: Array, largest: float, *, period: float) -> None:
        """Make the filters.

        Args:
            radii: cable wound per radian of the motor, (n,) [m].
            inertias: of the rotors, (n,) [kg·m²].
            largest: bias that is believed [N]; half of it is the prior's standard deviation.
            period: time between steps [s].
        """
        n = len(radii)
        noise = UNEXPLAINED**2 * 2.0 / (BAND * period)
        self.numbers = np.array([largest, period, exp(-BAND * period), noise])
        self.winches = np.stack([radii, inertias])
        prior = np.array([0.5 * largest, GAIN, DRY]) ** 2
        self.means, self.spreads = np.zeros((n, UNKNOWNS)), np.tile(np.diag(prior), (n, 1, 1))
        self.smoothed, self.last = np.zeros((n, UNKNOWNS + 1)), np.zeros((2, n))
        self.started = np.zeros(1, dtype=bool)

    @property
    def values(self) -> Array:
        """What each load cell says too much, (n,) [N], at most the largest believed."""
        return np.clip(self.means[:, BIAS], -self.numbers[LARGEST], self.numbers[LARGEST])

    def restart(self) -> None:
        """Forget the last sample but not what was learnt: torques have not been ours since."""
        self.started[0] = False

    def step(self, measured: Array, speeds: Array, torques: Array) -> None:
        """Take tensions (n,) [N], motor speeds (n,) [rad/s], and the torques (n,) [N·m] till now.

        Torques are those held since the last step; positive winds in.
        """
        learn_bias(
            *(measured, speeds, torques, self.winches, self.numbers, self.started),
            *(self.last, self.smoothed, self.means, self.spreads),
        )


@njit(cache=True, error_model="numpy")
def learn_bias(
    measured: Array,
    speeds: Array,
    torques: Array,
    winches: Array,
    numbers: Array,
    started: NDArray[np.bool_],
    last: Array,
    smoothed: Array,
    means: Array,
    spreads: Array,
) -> None:
    """Do what `LoadCellBias.step` does, on its arrays."""
    if started[0]:
        tensions = 0.5 * (measured + last[0])
        accelerations = (speeds - last[1]) / numbers[PERIOD]
        fade, out = numbers[FADE], smoothed
        _smooth(tensions, speeds, accelerations, torques, winches[0], winches[1], fade, out)
        spreads[:, BIAS, BIAS] += WANDER**2 * numbers[PERIOD]
        _learn(smoothed, numbers[NOISE], means, spreads)
    else:
        smoothed[:] = 0.0
    last[0], last[1], started[0] = measured, speeds, True


@njit(cache=True, error_model="numpy")
def _smooth(
    tensions: Array,
    speeds: Array,
    accelerations: Array,
    torques: Array,
    radii: Array,
    inertias: Array,
    fade: float,
    out: Array,
) -> None:
    """Smooth both sides of the balance, a row per cable: what 1, τ/r, −sgn q̇ go with, and left."""
    for i in range(len(radii)):
        pull = torques[i] / radii[i]
        left = tensions[i] - pull + inertias[i] / radii[i] * accelerations[i]
        direction = speeds[i] / (abs(speeds[i]) + CREEP)
        for column, value in enumerate((1.0, pull, -direction, left)):
            out[i, column] += (1.0 - fade) * (value - out[i, column])


@njit(cache=True, error_model="numpy")
def _learn(smoothed: Array, noise: float, means: Array, spreads: Array) -> None:
    """Update means (n, 3) and spreads (n, 3, 3) by a sample of variance `noise` [N²] each."""
    reach = np.empty(UNKNOWNS)
    for i in range(len(means)):
        row, surprise, spread = smoothed[i, :UNKNOWNS], smoothed[i, UNKNOWNS], noise
        for a in range(UNKNOWNS):
            surprise -= row[a] * means[i, a]
            reach[a] = 0.0
            for b in range(UNKNOWNS):
                reach[a] += spreads[i, a, b] * row[b]
            spread += row[a] * reach[a]
        for a in range(UNKNOWNS):
            means[i, a] += reach[a] / spread * surprise
            for b in range(UNKNOWNS):
                spreads[i, a, b] -= reach[a] * reach[b] / spread
