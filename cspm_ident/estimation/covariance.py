"""Covariance of sums of coloured scores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def long_run_sum(parts: Sequence[Array], length: int) -> Array:
    """Return the covariance of the sum of all scores, with Bartlett's window (Newey, West 1987).

    Its expectation is that of sums over all blocks of `length` samples.
    """
    result = sum(part.T @ part for part in parts)
    for lag in range(1, length):
        for part in parts:
            crossed = part[lag:].T @ part[: len(part) - lag] if len(part) > lag else 0.0
            result = result + (1.0 - lag / length) * (crossed + np.transpose(crossed))
    return np.asarray(result)
