"""How much of the time a drive is at its limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LIMIT = 0.995
"""Of the torque limit: rounding of the drive."""
SHARE = 0.01
"""Of the samples: what is at the limit less often moves no estimate by more."""


def at_limit(torque: Array, limit: float) -> NDArray[np.bool_]:
    """Return at which samples, shape (n,), a torque is at its limit [N·m]."""
    return np.asarray(np.abs(torque) >= LIMIT * limit)


def limited_share(torque: Array, limit: float) -> float:
    """Return the share of samples, shape (n,), at which a torque is at its limit [N·m]."""
    known = torque[~np.isnan(torque)]
    return float(np.mean(at_limit(known, limit))) if len(known) else 0.0


def limit_text(share: float, limit: float) -> str:
    """Return in words that a drive is at its limit [N·m] too often; empty where it is not."""
    if share <= SHARE:
        return ""
    return f"at its limit of {limit:.3g} N·m in {100.0 * share:.1f} % of the samples"
