"""What a laboratory does today: all numbers of the file fitted by least squares, nothing added."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import norm

from bench.blind.peers.library import Library
from bench.blind.peers.report import fits, left_with, report_of, retuned_weights

_CHANCE = 0.01


def diagnosis_of(library: Library) -> dict[str, Any]:
    """Return the numbers that least squares say are wrong, by white errors and Bonferroni.

    The fit is that of all numbers, reported or not.
    """
    own = [c for c in library.candidates if c.effect.physics.alter is not None]
    nuisance, numbers = library.gram.nuisance, library.gram.columns_of(own)
    weights = library.sums.weights(library.gram.with_nuisance(own))[len(nuisance) :]
    # Half the width of a 95 % interval is 1.96 standard errors.
    errors = library.sums.half_width(nuisance, numbers) / norm.isf(0.025)
    sure = norm.isf(0.5 * _CHANCE / max(1, len(numbers)))
    reported = report_of(library, numbers[np.abs(weights) > sure * errors], intervals=True)
    after = left_with(library, retuned_weights(library))
    return reported | {"residuals": fits(library, after)}
