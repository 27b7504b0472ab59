"""Pair exchange: two effects on one element in place of hypotheses selected one by one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, freedom
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.joint_pairs import Pair, best_pairs

Index = NDArray[np.intp]


def pair_instead(
    fits: Fits,
    significance: Significance,
    chosen: Sequence[Hypothesis],
    kept: Sequence[Hypothesis],
    free: Sequence[Candidate],
) -> list[Hypothesis] | None:
    """Return the selection with a better pair in place of some hypotheses, or None.

    The pair must explain significantly more without spanning the replaced columns, or as much with
    fewer parameters. Both of its effects must be significant. Hypotheses that explain something
    else than the pair stay.

    Args:
        fits: of the searched recordings.
        significance: of hypotheses in these fits.
        chosen: all selected hypotheses.
        kept: those that stay in any case.
        free: candidates that may be added.
    """
    given_up = [h for h in chosen if h not in kept]
    if not given_up or any(h.onset for h in chosen):
        return None
    for pair in best_pairs(fits.gram, fits.sums, fits.columns(kept), free):
        stay = [h for h in given_up if _says_else(fits, h, chosen, [*kept, *pair])]
        beside, replaced = [*kept, *stay], [h for h in given_up if h not in stay]
        if (
            replaced
            and _is_better(fits, pair, replaced, beside)
            and fits.is_plausible([*beside, *pair])
            and _are_both_needed(fits, significance, pair, beside)
        ):
            return [*beside, *pair]
    return None


def _says_else(
    fits: Fits, hypothesis: Hypothesis, chosen: Sequence[Hypothesis], instead: Sequence[Hypothesis]
) -> bool:
    """Return whether a hypothesis keeps most of its gain beside the hypotheses `instead`."""
    if any(not set(hypothesis.candidates).isdisjoint(h.candidates) for h in instead):
        return False
    others = [h for h in chosen if h is not hypothesis]
    least = fits.thresholds.majority_share * fits.gain(hypothesis, fits.columns(others)).total
    return fits.gain(hypothesis, fits.columns(instead)).total > least


def _is_better(
    fits: Fits, pair: Pair, replaced: Sequence[Hypothesis], beside: Sequence[Hypothesis]
) -> bool:
    """Return whether a pair explains significantly more, or as much with fewer parameters."""
    base, limits = fits.columns(beside), fits.thresholds
    left = fits.sums.held_out(fits.beside(base, *replaced))
    better = gain_of(left - fits.sums.held_out(fits.beside(base, *pair)))
    if sum(map(freedom, pair)) < sum(map(freedom, replaced)):
        gained = (fits.sums.held_out(base) - left).sum()
        return bool(better.total > -limits.model_form_error_share * gained)
    both, own = (np.concatenate([fits.own_columns(h) for h in each]) for each in (pair, replaced))
    wider = np.all(fits.sums.spanned(base, both, own) > 1.0 - limits.material_share)
    return bool(better.total > limits.tie_sigma * better.error and not wider)


def _are_both_needed(
    fits: Fits, significance: Significance, pair: Pair, beside: Sequence[Hypothesis]
) -> bool:
    """Return whether each is significant beside the other, and no small share of their gain."""
    both = np.concatenate([fits.own_columns(h) for h in pair])
    gained = fits.sums.gain(fits.columns(beside), both).total
    least = fits.thresholds.minor_share * gained
    for one, other in (pair, pair[::-1]):
        base = fits.columns([*beside, other])
        gain = fits.gain(one, base)
        if gain.total < least or not significance.counts(base, one, gain, known=1):
            return False
    return True
