"""Which of several hypotheses that explain the same is taken."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.parsimony import simplest
from cspm_ident.diagnosis.selection.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
PLACE = Place(Channel.SHAFT, "only")
SHAPE = (("stribeck_speed", 1.0),)
DRY, LOADED, BREAKAWAY = (
    Hypothesis(catalogue()[name], (Candidate(catalogue()[name], "only", shape),))
    for name, shape in (
        ("winch_coulomb_friction", ()),
        ("winch_load_friction", ()),
        ("winch_stribeck_friction", SHAPE),
    )
)


def search(loaded):
    """A shaft with dry friction; friction by load is so much of it, breakaway all and something."""
    rng, times = np.random.default_rng(3), STEP * np.arange(ROWS)
    speed = np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times)
    dry, else_ = np.sign(speed), np.cos(3.3 * times)
    target = (0.3 * dry + 0.05 * rng.standard_normal(ROWS))[:, None]
    columns = (
        (DRY, dry[:, None, None]),
        (LOADED, (loaded * dry + (1.0 - loaded) * else_)[:, None, None]),
        (BREAKAWAY, np.stack([dry, else_], axis=1)[:, None, :]),
    )
    own = {each.candidates[0]: values for each, values in columns}
    return Search(gather([[Equation(PLACE, times, target, own, target)]], BLOCK_S))


@pytest.mark.parametrize("order", [(DRY, LOADED), (LOADED, DRY)])
def test_of_what_has_fewer_numbers_that_is_taken_which_explains_most(order):
    fits = search(0.9).fits
    assert simplest(fits, BREAKAWAY, order, fits.columns([]), []) == DRY


def test_of_what_explains_the_same_the_first_is_taken():
    fits = search(1.0).fits
    for order in ((DRY, LOADED), (LOADED, DRY)):
        assert simplest(fits, BREAKAWAY, order, fits.columns([]), []) == order[0]


def test_what_has_fewer_numbers_is_not_taken_where_it_explains_less():
    fits = search(0.3).fits
    assert simplest(fits, BREAKAWAY, [LOADED], fits.columns([]), []) == BREAKAWAY
