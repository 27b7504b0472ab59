"""How far unexplained functions of the signals may move the weights of what was found.

A law that the catalogue lacks biases the laws beside it. What a free function of a signal still
takes from a residual shows the size of such a law, but only the part of it that the fitted columns
do not span. The part that they do span moves their weights. It is taken to be as large as the part
that shows: the function's values at its knots are independent, with one variance (a model
discrepancy as in Kennedy and O'Hagan, J. R. Stat. Soc. B 63(3), 2001).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import causes_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, parts_of
from cspm_ident.diagnosis.regression.jackknife import RANK
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]
Index = NDArray[np.intp]
# Probability on either side of a 95 % interval.
_OUTSIDE = 0.025


def moved_by_functions(fits: Fits, hypotheses: Sequence[Hypothesis]) -> dict[Candidate, Array]:
    """Return half widths by which a free function may move each weight, by candidate.

    The largest over all signals of the residuals in which a hypothesis acts. A function of time
    counts where it is significant: no other block confirms what one block shows of it.

    Args:
        fits: of the searched data.
        hypotheses: all that are in the model.
    """
    gram = fits.gram
    candidates, common = parts_of(hypotheses)
    own = gram.columns_of(candidates)
    causes, number = causes_of(gram, candidates, common)
    found = np.zeros(causes.shape[1])
    places = gram.places_of(own)
    drivers = [d for d in gram.terms if isinstance(d, Driver) and d.place in places]
    chance = fits.thresholds.false_alarm_rate / max(1, len(drivers))
    for driver in drivers:
        base = np.concatenate([gram.nuisance, gram.columns_of([driver])])
        sums, beside, free = fits.sums.combined(base, own, causes)
        nuisance, function = np.split(beside, [len(gram.nuisance)])
        both = np.concatenate([nuisance, free])
        if driver.of_time and sums.p_value(both, function) > chance:
            continue
        gained = sums.gain_within if driver.of_time else sums.gain
        gain = gained(both, function).total
        if gain > 0.0:
            found = np.maximum(found, _moved(sums, nuisance, free, function, gain))
    return gram.parted(candidates, found[number])


def _moved(sums: BlockRegression, base: Index, own: Index, function: Index, gain: float) -> Array:
    """Return half widths of 95 % intervals of weights for a function that gains so much.

    Args:
        sums: of all columns.
        base: columns beside the weights.
        own: the weights' columns, (m,).
        function: the function's columns.
        gain: reduction of the hold-out squares by the function.
    """
    turned, left = sums.projected(np.concatenate([base, own]), function)
    sizes = np.linalg.eigvalsh(left)
    rank = int(np.sum(sizes > RANK * sizes[-1]))
    if not rank:
        return np.zeros(len(own))
    scatter = np.sqrt(gain / np.sum(sizes) * np.sum(turned[len(base) :] ** 2, axis=1))
    return np.asarray(student.isf(_OUTSIDE, rank) * scatter / sums.lengths[own])
