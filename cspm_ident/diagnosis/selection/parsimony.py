"""Parsimony: the choice among hypotheses that explain the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_comparison import behind, paired
from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    freedom,
    is_number,
    is_wider,
    unusual,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits

Index = NDArray[np.intp]


def simplest(
    fits: Fits,
    best: Hypothesis,
    rivals: Sequence[Hypothesis],
    base: Index,
    chosen: Sequence[Hypothesis],
) -> Hypothesis:
    """Return the hypothesis of fewest parameters, or elements, that is no worse than the best.

    A rival with as many parameters replaces it in four cases:

    1. It explains more in most blocks, even if its own gain is less significant. This holds for
       fewer parameters too.
    2. It is a wrong parameter of the test-bed file, which adds no physics.
    3. It delays one reading where the other would put a reading before its stamp.
    4. It is a clock error of healthy size, and the other is a fault.

    Args:
        fits: of all columns.
        best: the hypothesis of the largest gain.
        rivals: hypotheses that explain the same.
        base: columns of all hypotheses selected before.
        chosen: those hypotheses.
    """
    reference = left = fits.held_out(best, base)
    gained = gain_of(fits.sums.held_out(base) - reference)
    fewest, sigma = best, fits.thresholds.tie_sigma
    little = min(sigma * gained.error, fits.thresholds.minor_share * gained.total)
    for rival in rivals:
        if not fits.is_plausible([*chosen, rival]) or fits.contradicts(rival, chosen):
            continue
        late = fits.delayed_columns(fits.own_columns(rival), best.onset)
        leaves = late.held_out(rival, base)
        worse, wider = gain_of(leaves - reference), freedom(rival) - freedom(fewest)
        fewer = wider < 0 or (wider == 0 and is_wider(fewest, rival))
        more = leaves.sum() < left.sum() and behind(paired(leaves - left)) <= -sigma
        if (wider <= 0 and more) or (fewer and worse.total <= little):
            fewest, left = replace(rival, onset=best.onset), leaves
        elif wider == 0 and worse.total <= gained.total * _allowed(fits, rival, fewest, chosen):
            fewest, left = rival, leaves
    return fewest


def _allowed(fits: Fits, one: Hypothesis, other: Hypothesis, chosen: Sequence[Hypothesis]) -> float:
    """Return the share of the gain by which one may be worse, because it is likelier a priori.

    Likelier are clock errors of healthy size, and wrong parameters of the test-bed file, which add
    no physics. Of two wrong parameters, the one with the smaller relative error is likelier. The
    share is -inf where one is not likelier.
    """
    limits = fits.thresholds
    simpler, form_error = limits.minor_share, limits.model_form_error_share
    healthy = [fits.is_negligible(each, [*chosen, each]) for each in (one, other)]
    if healthy[0] != healthy[1]:
        return simpler if healthy[0] else -np.inf
    if fits.are_early([*chosen, other]) and not fits.are_early([*chosen, one]):
        return simpler
    if is_number(one) != is_number(other):
        return form_error if is_number(one) else -np.inf
    if not is_number(one):
        return -np.inf
    sizes = [unusual(fits.values([*chosen, each]), each) for each in (one, other)]
    return form_error if sizes[0] < sizes[1] else -np.inf
