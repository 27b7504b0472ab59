"""Screening: the effects that a full search tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]


def screened(candidates: Sequence[Candidate], gains: Array, most: int) -> list[Candidate]:
    """Return the best shape and element of each of the `most` effects of largest gain.

    Args:
        candidates: all candidates.
        gains: of each candidate, (candidates,).
        most: maximum number of effects.
    """
    best: dict[str, tuple[float, Candidate]] = {}
    for candidate, gain in zip(candidates, gains, strict=True):
        if candidate.effect_id not in best or gain > best[candidate.effect_id][0]:
            best[candidate.effect_id] = float(gain), candidate
    ranked = sorted(best.values(), key=lambda each: -each[0])
    return [candidate for _, candidate in ranked[:most]]
