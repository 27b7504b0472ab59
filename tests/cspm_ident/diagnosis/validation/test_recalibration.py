"""What held-out data may still move of a survey's errors, and what they may not."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.recalibration import recalibrated, surveyed_in
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.survey import ACCURACY

END = Candidate(catalogue()["cable_exit_offset"], "one")
DRY = Candidate(catalogue()["winch_coulomb_friction"], "one")
ROWS = 400


def cable(off, channel=Channel.TENSION):
    """A residual in units of its noise whose end is `off` [m] along x; its start is free."""
    rng = np.random.default_rng(3)
    columns = 2e3 * rng.normal(size=(ROWS, 1, 3))
    target = columns[:, :, 0] * off + 5.0 + rng.normal(size=(ROWS, 1))
    times, start = 0.1 * np.arange(ROWS), np.ones((ROWS, 1, 1))
    return Equation(Place(channel, "one"), times, target, {END: columns}, target, start)


@pytest.mark.parametrize(
    ("known", "more", "channel", "moved"),
    [
        (0.0, 2.0 * ACCURACY, Channel.TENSION, True),
        (2.0 * ACCURACY, ACCURACY, Channel.TENSION, True),
        (0.0, 5.0 * ACCURACY, Channel.TENSION, False),
        (3.0 * ACCURACY, ACCURACY, Channel.TENSION, False),
        (0.0, 2.0 * ACCURACY, Channel.SHAFT, False),
    ],
)
def test_what_is_left_of_an_end_is_taken_off_within_the_accuracy_of_a_survey(
    known, more, channel, moved
):
    before = cable(more, channel)
    after = recalibrated(before, {END: np.array([known, 0.0, 0.0])})
    assert after.left.std() == pytest.approx(1.0 if moved else before.left.std(), rel=0.1)
    assert bool(after.left.std() < 0.6 * before.left.std()) is moved


def test_a_wrong_number_of_the_file_is_not_moved():
    before = cable(ACCURACY)
    assert recalibrated(before, {END: np.array([6.0 * ACCURACY, 0.0, 0.0])}) is before
    assert recalibrated(before, {DRY: np.array([0.1])}) is before
    assert recalibrated(replace(before, columns={}), {END: np.zeros(3)}).columns == {}


def test_only_surveyed_places_of_the_model_are_looked_at():
    assert surveyed_in({DRY: np.zeros(1), END: np.zeros(3)}) == (END.effect,)
    assert surveyed_in({DRY: np.zeros(1)}) == ()
