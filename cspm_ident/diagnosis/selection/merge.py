"""Merge: one effect on one element in place of several faults that it explains."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, freedom
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.regressors import Candidate


def one_instead(
    fits: Fits, significance: Significance, chosen: Sequence[Hypothesis], free: Sequence[Candidate]
) -> tuple[Hypothesis, ...] | None:
    """Return a hypothesis of one fault and the hypotheses that it replaces, or None.

    Example: a heavy rope pulls the bar down at one end. A heavier bar with a shifted centre of mass
    explains the same with two faults. The merged hypothesis must explain as much, within model-form
    error and block noise. Without fewer parameters, it must explain no less.

    Args:
        fits: of the searched recordings.
        significance: of hypotheses in these fits.
        chosen: all selected hypotheses.
        free: candidates that may be added.
    """
    found = [
        h for h in chosen if not (fits.is_negligible(h, chosen) or fits.is_calibration(h, chosen))
    ]
    if any(h.onset for h in found):
        return None
    left = fits.sums.held_out(fits.columns(chosen))
    singles = [Hypothesis(c.effect, (c,)) for c in free]
    columns = [fits.own_columns(h) for h in singles]
    several = [(h,) for h in found if h.causes > 1]
    for few in (*several, *combinations(found, 2)):
        others = [h for h in chosen if h not in few]
        base = fits.columns(others)
        gained = gain_of(fits.sums.held_out(base) - left)
        undecided = fits.thresholds.model_form_error_share * gained.total
        together = np.concatenate([fits.own_columns(h) for h in few])
        *gains, most = fits.sums.gains_beyond(base, [*columns, together])
        for k in np.argsort(gains)[::-1]:
            if gains[k] < most - undecided:
                break
            less = gain_of(fits.sums.held_out(np.concatenate([base, columns[k]])) - left)
            wider = freedom(singles[k]) - sum(map(freedom, few))
            # A further fault counts as one parameter; `freedom` counts it within one hypothesis.
            noise = fits.thresholds.tie_sigma * less.error
            allowed = min(undecided, noise) if wider < 0 else 0.0
            if (
                wider < len(few)
                and less.total <= allowed
                and fits.is_plausible([*others, singles[k]])
                and significance.counts(base, singles[k], gained, len(others))
            ):
                return singles[k], *few
    return None
