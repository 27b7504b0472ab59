"""One effect on one element instead of several faults that it explains all."""

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
    """Return a hypothesis of one fault, and those of two and more that it stands for.

    A heavy rope pulls the bar down at one end: as much as a heavier bar whose centre of mass lies
    elsewhere, which says the same with two faults. It has to explain as much as they do, as far as
    models are true and blocks tell; where it has no fewer numbers, no less.

    Args:
        fits: of what was searched.
        significance: of these.
        chosen: what was found.
        free: what may be added to it.
    """
    found = [h for h in chosen if not fits.is_negligible(h, chosen)]
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
            # A further fault counts for a number, which `freedom` knows of a single finding.
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
