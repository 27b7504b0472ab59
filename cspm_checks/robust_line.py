"""Straight lines through data of which some is wrong."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.robust_statistics import huber_fit

Array = NDArray[np.float64]
_HUBER = 1.345  # 95 % efficiency with normal errors, Huber 1964
_ROUNDS = 30
# Numbers that follow a line to their last digits are made by a formula, not measured.
_EXACT = 1e-12


class RobustLine(NamedTuple):
    """y = slope·x + other·z.

    Attributes:
        slope: of the regressor x.
        error: standard error of the slope as white residuals give it.
        explained: share of the weighted variance of y that x and z explain, 0 to 1.
    """

    slope: float
    error: float
    explained: float


def robust_line(x: Array, y: Array, z: Array) -> RobustLine | None:
    """Return the line through points by Huber's weights; None where x does not vary beside z.

    Args:
        x: the regressor of interest, shape (n,).
        y: what it shall explain, shape (n,).
        z: a second regressor, such as ones for a constant, shape (n,).
    """
    size = np.linalg.norm(x), np.linalg.norm(z)
    if len(x) < 4 or min(size) == 0.0:
        return None
    columns = np.stack([x / size[0], z / size[1]], axis=1)
    if np.linalg.svd(columns, compute_uv=False)[1] < 1e-6:
        return None
    solution, weights = huber_fit(columns, y, _HUBER, _ROUNDS, exact=_EXACT)
    left = float(np.sum(weights * (y - columns @ solution) ** 2))
    # Against what z alone explains, so that a common trend is no relation.
    alone = (weights * z) @ y / ((weights * z) @ z)
    whole = float(np.sum(weights * (y - alone * z) ** 2))
    covariance = np.linalg.inv((columns * weights[:, None]).T @ columns) * left / (len(x) - 2)
    explained = 1.0 - left / whole if whole > 0.0 else 1.0
    return RobustLine(
        float(solution[0] / size[0]), float(np.sqrt(covariance[0, 0]) / size[0]), explained
    )
