"""Variance accounted for."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def vaf(measured: Array, modelled: Array) -> float:
    """Return (1 − var(y − ŷ)/var(y))·100 %, thesis (3-9), for signals of one shape."""
    return float(100.0 * (1.0 - np.var(measured - modelled) / np.var(measured)))


def error_percent(share: float) -> float:
    """Return 100·|y − ŷ|/|y| about the means [%], of a VAF [%]."""
    return 100.0 * sqrt(max(0.0, 1.0 - share / 100.0))
