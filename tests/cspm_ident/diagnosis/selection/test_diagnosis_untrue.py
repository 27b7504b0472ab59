"""By how much a finding on several elements is seen to be off on each."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
TIMES = STEP * np.arange(ROWS)
FIRST, SECOND = (Candidate(catalogue()["winch_viscous_friction"], name) for name in ("a", "b"))
BOTH = Hypothesis(FIRST.effect, (FIRST, SECOND))
SPEEDS = {FIRST: np.sin(2.1 * TIMES), SECOND: np.sin(3.7 * TIMES)}


def curve(speed):
    return speed**3 - 0.75 * speed


def equation(place, curved, *candidates):
    """Friction in proportion to speed, of the first candidate with so much of a curve."""
    noise = 0.01 * np.random.default_rng(5).standard_normal(ROWS)
    bent = curve(SPEEDS[candidates[0]])
    target = (sum(SPEEDS[c] for c in candidates) + curved * bent + noise)[:, None]
    columns = {c: SPEEDS[c][:, None, None] for c in candidates}
    columns[Driver(place, "speed [rad/s]")] = bent[:, None, None]
    return Equation(place, TIMES, target, columns, target)


def model_form_error(*equations, of=BOTH):
    gram = gather([equations], BLOCK_S)
    return Fits(gram, BlockRegression(gram)).model_form_error(of, [])


def test_it_is_off_where_a_free_function_shows_it():
    """A curve of a fifth beside a line: rms 0.05 against 0.71."""
    shares = model_form_error(
        equation(Place(Channel.SHAFT, "a"), 0.2, FIRST),
        equation(Place(Channel.SHAFT, "b"), 0.0, SECOND),
    )
    bent = 0.2 * np.std(curve(SPEEDS[FIRST])) / np.std(SPEEDS[FIRST])
    assert shares[FIRST] == pytest.approx(bent, rel=0.05)
    assert shares[SECOND] < 0.1 * bent


def test_where_several_act_it_may_be_any_of_them():
    place = Place(Channel.WRENCH, "bar")
    shares = model_form_error(equation(place, 0.2, FIRST, SECOND))
    bent = 0.2 * np.std(curve(SPEEDS[FIRST])) / np.std(SPEEDS[FIRST])
    assert list(shares.values()) == pytest.approx([bent / np.sqrt(2.0)] * 2, rel=0.05)


def test_what_has_one_cause_is_off_as_one():
    place = Place(Channel.WRENCH, "bar")
    shares = model_form_error(equation(place, 0.2, FIRST, SECOND), of=replace(BOTH, common=True))
    bent = 0.2 * np.std(curve(SPEEDS[FIRST])) / np.std(SPEEDS[FIRST])
    assert list(shares.values()) == pytest.approx([bent / np.sqrt(2.0)] * 2, rel=0.05)
    assert len(set(shares.values())) == 1
