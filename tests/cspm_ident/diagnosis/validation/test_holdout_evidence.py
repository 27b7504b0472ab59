"""What held-out data say for a finding, or against it."""

import numpy as np
import pytest

from cspm_ident.diagnosis.finding import Reason
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.validation.holdout_evidence import objection, raised
from cspm_sim.effects import Channel

PLACES = [Place(Channel.SHAFT, "a"), Place(Channel.TENSION, "a")]


def losses(*means, seed=0, scatter=1.0, blocks=24):
    """By place, losses with such a mean in each block."""
    rng = np.random.default_rng(seed)
    return {
        place: 10.0 + mean + scatter * rng.standard_normal(blocks)
        for place, mean in zip(PLACES, means, strict=True)
    }


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((-2.0, 0.0), None),
        ((0.0, 0.0), Reason.NOT_CONFIRMED),
        ((2.0, 0.0), Reason.RAISES_HOLDOUT),
        # Whatever it explains elsewhere.
        ((-9.0, 2.0), Reason.RAISES_HOLDOUT),
    ],
)
def test_a_finding_has_to_lower_a_residual_and_raise_none(change, said):
    assert objection(losses(0.0, 0.0), losses(*change, seed=1)) is said


def test_what_lowers_all_a_little_is_confirmed_together():
    change = (-0.75, -0.75)
    without, with_it = losses(0.0, 0.0, scatter=0.9), losses(*change, seed=1, scatter=0.9)
    assert objection(without, with_it) is None


def test_blocks_without_rows_and_residuals_that_vanish_say_nothing():
    without, with_it = losses(0.0, 0.0), losses(-2.0, 0.0, seed=1)
    without[PLACES[0]][3] = np.nan
    with_it[PLACES[1]][:] = np.nan
    assert objection(without, with_it) is None
    assert objection(without, {}) is Reason.NOT_CONFIRMED


def test_only_what_is_raised_counts_as_harm():
    without = {place: np.array([4.0, np.nan]) for place in PLACES}
    with_it = dict(zip(PLACES, (np.array([7.0, 1.0]), np.array([1.0, 1.0])), strict=True))
    assert raised(without, with_it) == pytest.approx(3.0)
