"""Estimates that outliers do not move: noise from differences, and Huber's regression."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Median absolute deviation of a normal distribution to its standard deviation.
MAD_TO_SIGMA = 1.4826
_SMALLEST = 1e-300


def difference_noise(values: Array, order: int = 3) -> Array:
    """Return the standard deviation of what is white in a series, one per column.

    Differences of an order suppress what is smooth; white noise of them has C(2·order, order) times
    its variance, the sum of the squared binomial coefficients. The median is robust to steps.

    Args:
        values: samples at equal steps, shape (k,) or (k, channels), k > order.
        order: of the differences. Third ones serve residuals and slow signals. Fourth ones serve a
            sensor whose band is full, where the signal itself reaches up to the sample rate.

    Returns:
        Shape () or (channels,), in the unit of `values`.
    """
    apart = np.abs(np.diff(values, order, axis=0))
    return np.asarray(
        MAD_TO_SIGMA * np.median(apart, axis=0) / np.sqrt(float(comb(2 * order, order)))
    )


def huber_fit(
    columns: Array, target: Array, threshold: float, rounds: int, exact: float | None = None
) -> tuple[Array, Array]:
    """Return coefficients and row weights of Huber's regression by reweighted least squares.

    Source: Huber, Ann. Math. Stat. 35(1), 1964; the scale is the median absolute deviation.

    Args:
        columns: regressors, shape (n, m).
        target: what they shall explain, shape (n,).
        threshold: residual, in units of the scale, from which a row counts less. 1.345 has 95 % of
            the efficiency of least squares with normal errors. 3 leaves nearly all normal errors
            alone and serves where the efficient estimate is tried beside it.
        rounds: of reweighting.
        exact: scale, as a share of the largest |target|, from which the fit counts as exact and
            reweighting ends; None to go on, for noisy data.

    Returns:
        Coefficients of the last solution, shape (m,), and weights from its residuals, shape (n,).
    """
    weights: Array = np.ones(len(target))
    solution: Array = np.zeros(columns.shape[1])
    for _ in range(rounds):
        root = np.sqrt(weights)
        solution = np.asarray(
            np.linalg.lstsq(columns * root[:, None], target * root, rcond=None)[0]
        )
        left = np.abs(target - columns @ solution)
        scale = MAD_TO_SIGMA * float(np.median(left))
        if exact is not None and scale <= exact * float(np.abs(target).max()):
            break
        scale = max(scale, _SMALLEST)
        weights = np.asarray(np.minimum(1.0, threshold * scale / np.maximum(left, _SMALLEST)))
    return solution, weights
