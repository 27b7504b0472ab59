"""Residuals on what was not searched: from its beginning on, with the memory of what was before."""

import numpy as np
import pytest
from crept_cables import CREEPING, CREPT, HEALTHY, START_S, TRUE

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.residual_equation import steady
from cspm_ident.diagnosis.selection.search_pass import noise_of
from cspm_ident.diagnosis.validation import holdout_residuals as judgement
from cspm_ident.diagnosis.validation.holdout_residuals import judged


def fits(measurement, start=START_S):
    noise = noise_of(steady([equations_of(measurement, ())]))
    found = judged([measurement], [start], {}, {CREEPING: TRUE}, noise, {})
    return {each.place: each for each in found}


def test_what_a_cable_remembers_at_the_start_is_what_it_was(crept, monkeypatch):
    fit = fits(crept)[CREPT]
    healthy = fits(crept)[HEALTHY]
    assert fit.before > 5.0 * healthy.before
    assert fit.after < 1.5 * healthy.after
    # Were it at rest there, the right physics would leave far more.
    monkeypatch.setattr(judgement, "LEAD_S", 0.0)
    assert fits(crept)[CREPT].after > 2.0 * fit.after


def test_only_what_was_not_searched_counts(crept):
    """What is before the start is for memories alone."""
    late = fits(crept)[CREPT]
    alone = fits(crept.within(START_S, np.inf))[CREPT]
    assert late.before == pytest.approx(alone.before, rel=0.02)
    assert late.measured == pytest.approx(alone.measured, rel=0.01)
    # The sea begins with a ramp, so that all of it moves less than its end.
    assert fits(crept, 0.0)[CREPT].measured < 0.9 * late.measured


def test_a_residual_without_rows_there_is_left_out(crept, monkeypatch):
    """As of a cable that hangs slack in the end."""
    whole = judgement.equations_of

    def slack(measurement, effects, **given):
        found = whole(measurement, effects, **given)
        return [e.within(0.0, START_S) if e.place == HEALTHY else e for e in found]

    monkeypatch.setattr(judgement, "equations_of", slack)
    found = fits(crept)
    assert HEALTHY not in found
    assert CREPT in found
    assert HEALTHY in fits(crept, 0.0)
