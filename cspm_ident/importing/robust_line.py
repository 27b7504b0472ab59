"""Straight lines through data of which some is wrong."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_HUBER = 1.345  # 95 % efficiency with normal errors, Huber 1964
_MAD_TO_SIGMA = 1.4826
_ITERATIONS = 30


class Line(NamedTuple):
    """y = slope·x + other·z.

    Attributes:
        slope: of the regressor x.
        error: standard error of the slope as white residuals give it.
        explained: share of the weighted variance of y that x and z explain, 0 to 1.
    """

    slope: float
    error: float
    explained: float


def robust_line(x: Array, y: Array, z: Array) -> Line | None:
    """Return the line through points by Huber's weights; None where x does not vary beside z.

    Args:
        x: the regressor asked about, shape (n,).
        y: what it shall explain, shape (n,).
        z: a second regressor, such as ones for a constant, shape (n,).
    """
    size = np.linalg.norm(x), np.linalg.norm(z)
    if len(x) < 4 or min(size) == 0.0:
        return None
    columns = np.stack([x / size[0], z / size[1]], axis=1)
    if np.linalg.svd(columns, compute_uv=False)[1] < 1e-6:
        return None
    weights = np.ones(len(x))
    solution = np.zeros(2)
    for _ in range(_ITERATIONS):
        root = np.sqrt(weights)[:, None]
        solution = np.linalg.lstsq(columns * root, y * root[:, 0], rcond=None)[0]
        residual = np.abs(y - columns @ solution)
        scale = _MAD_TO_SIGMA * float(np.median(residual))
        if scale <= 1e-12 * float(np.abs(y).max()):
            break
        weights = np.minimum(1.0, _HUBER * scale / np.maximum(residual, 1e-300))
    left = float(np.sum(weights * (y - columns @ solution) ** 2))
    # Against what z alone explains, so that a common trend is no relation.
    alone = (weights * z) @ y / ((weights * z) @ z)
    whole = float(np.sum(weights * (y - alone * z) ** 2))
    covariance = np.linalg.inv((columns * weights[:, None]).T @ columns) * left / (len(x) - 2)
    explained = 1.0 - left / whole if whole > 0.0 else 1.0
    return Line(float(solution[0] / size[0]), float(np.sqrt(covariance[0, 0]) / size[0]), explained)
