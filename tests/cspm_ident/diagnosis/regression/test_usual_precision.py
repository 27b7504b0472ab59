"""Numbers that come together are expected to be of their usual size, each of six of an offset."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.usual_precision import usual_precision
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S, USUAL = 2400, 0.01, 1.0, 1e-3
OFFSET, MASS = (
    Candidate(catalogue()["pose_offset"], "bar"),
    Candidate(catalogue()["bar_mass"], "bar"),
)
TRUE = np.array([8e-4, 0.0, 0.0, 0.0, 0.0, 0.0])


def made(seed, hidden=1e-4):
    """Six regressors, four of which show hardly anything of a millimetre; noise of 1."""
    rng = np.random.default_rng(seed)
    loud = np.array([3e3, 3e3, *[3e3 * hidden] * 4])
    columns = loud * rng.standard_normal((ROWS, 6))
    target = columns @ TRUE + rng.standard_normal(ROWS)
    mass = rng.standard_normal((ROWS, 1))
    terms = {OFFSET: columns[:, None, :], MASS: mass[:, None, :]}
    own = Equation(
        Place(Channel.TENSION, "a"), STEP * np.arange(ROWS), target[:, None], terms, mass
    )
    gram = gather([[own]], BLOCK_S)
    return gram, BlockRegression(gram)


def plain(gram):
    """Least squares without what is known beforehand."""
    sums = BlockRegression(gram)
    sums._prior = np.zeros_like(sums._prior)
    return sums


def test_only_numbers_that_come_together_with_a_usual_size_are_expected():
    gram, _ = made(0)
    found = usual_precision(gram)
    assert np.all(found[gram.slices[OFFSET]] == USUAL**-2.0)
    assert np.all(found[gram.slices[MASS]] == 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_what_a_recording_does_not_show_stays_at_its_usual_size(seed):
    gram, sums = made(seed)
    own = np.arange(*gram.slices[OFFSET].indices(gram.width)[:2])
    ridge, free = sums.weights(own), plain(gram).weights(own)
    assert ridge[:2] == pytest.approx(TRUE[:2], abs=1e-4)
    assert np.all(np.abs(ridge[2:]) < USUAL)
    assert np.max(np.abs(free[2:])) > 10.0 * USUAL


def test_so_that_it_predicts_another_motion_that_shows_it():
    """Weights of one recording, on one that shows all six: whole they explode there."""
    gram, sums = made(1)
    own = np.arange(6)
    other, _ = made(2, hidden=1.0)
    left = {
        name: other.left(own, weights)[Place(Channel.TENSION, "a")]
        for name, weights in (
            ("none", np.zeros(6)),
            ("ridge", sums.weights(own)),
            ("free", plain(gram).weights(own)),
        )
    }
    assert left["ridge"] < 0.5 * left["none"]
    assert left["free"] > 10.0 * left["none"]


def test_what_is_not_shown_counts_as_no_number():
    gram, sums = made(3)
    own = np.arange(6)
    assert sums.freedom(own) == pytest.approx(2.0, abs=0.1)
    assert made(3, hidden=1.0)[1].freedom(own) == pytest.approx(6.0, abs=0.1)
    assert plain(gram).freedom(own) == 6.0


def test_combinations_keep_what_is_known_of_their_parts():
    """A sum of two numbers of a usual size is as sure as both; fitted alone it is the same."""
    _, sums = made(4)
    turn = np.zeros((6, 1))
    turn[2:4] = 1.0
    combined, _, own = sums.combined(np.zeros(0, dtype=int), np.arange(6), turn)
    products = (sums.lengths[2:4] ** 2).sum()
    expected = 2.0 * USUAL**-2.0
    assert combined.freedom(own) == pytest.approx(products / (products + expected), rel=0.05)


def test_a_column_of_zeros_is_not_excited_by_what_is_known_of_it():
    _, sums = made(5, hidden=0.0)
    assert sums.excited[:6].tolist() == [True, True, False, False, False, False]
