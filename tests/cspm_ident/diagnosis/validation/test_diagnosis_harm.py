"""Whether something makes worse what was not searched."""

import numpy as np
import pytest
from crept_cables import CREEPING, CREPT, HEALTHY, START_S, TRUE

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import steady
from cspm_ident.diagnosis.selection.search_pass import noise_of
from cspm_ident.diagnosis.validation.holdout_degradation import harm, raised, squares_left
from cspm_ident.diagnosis.validation.holdout_residuals import rms
from cspm_ident.diagnosis.validation.holdout_simulation import baselines_of
from cspm_sim.effects import Channel

ONE, OTHER = Place(Channel.TENSION, "sway_2"), Place(Channel.WRENCH, "bar")
BLOCKS, BLOCK_S = 12, 0.5


def left(one, other, scatter=0.0):
    """Squares of two residuals, in all and by blocks that scatter."""
    noise = 1.0 + scatter * np.where(np.arange(BLOCKS) % 2, 1.0, -1.0)
    return {ONE: one / BLOCKS * noise, OTHER: other / BLOCKS * np.ones(BLOCKS)}


@pytest.mark.parametrize(
    ("with_it", "scatter", "squares"),
    [
        # Less is left.
        ((60.0, 90.0), 0.0, 0.0),
        # More in all, surely or by chance.
        ((120.0, 90.0), 0.0, 20.0),
        ((120.0, 90.0), 0.5, 0.0),
        # One more than doubled, though in all there is less.
        ((210.0, 860.0), 0.9, 110.0),
        ((190.0, 860.0), 0.9, 0.0),
        # What takes most of one is there, whatever it does to the other.
        ((290.0, 490.0), 0.0, 0.0),
    ],
)
def test_what_adds_to_residuals_harms(with_it, scatter, squares):
    before = left(100.0, 100.0 if with_it[1] < 100.0 else 1000.0)
    assert harm(before, left(*with_it, scatter)) == pytest.approx(squares)


def test_residuals_that_are_not_there_both_times_say_nothing():
    assert harm({ONE: np.ones(BLOCKS)}, {OTHER: np.ones(BLOCKS)}) == 0.0


def test_what_is_right_takes_squares_and_thrice_of_it_adds_them(crept):
    noise = noise_of(steady([equations_of(crept, ())]))
    baselines = baselines_of([crept], [START_S], {})

    def found(weight):
        weights = {CREEPING: weight * TRUE} if weight else {}
        return squares_left(baselines, weights, noise, BLOCK_S)

    described = found(0.0)
    assert harm(described, found(1.0)) == 0.0
    assert harm(described, found(3.0)) > described[CREPT].sum()
    (rows,) = (e for e in equations_of(crept, ()) if e.place == HEALTHY)
    late = rows.within(START_S, np.inf).scaled(noise[HEALTHY])
    assert described[HEALTHY].sum() == pytest.approx(rms([late]) ** 2 * late.target.size, rel=0.05)
    by_block = [np.sum(late.within(t, t + BLOCK_S).target ** 2) for t in (START_S, START_S + 1.0)]
    assert np.all(described[HEALTHY][[0, 2]] > 0.2 * np.array(by_block))


@pytest.mark.parametrize(
    ("with_it", "scatter", "places"),
    [
        # Less is left of both, or more of one by less than half.
        ((60.0, 900.0), 0.0, ()),
        ((140.0, 900.0), 0.0, ()),
        # More than half again, surely or by the chance of a few blocks.
        ((160.0, 900.0), 0.0, (ONE,)),
        ((160.0, 900.0), 30.0, ()),
        # Whatever it takes elsewhere.
        ((160.0, 100.0), 0.0, (ONE,)),
    ],
)
def test_what_raises_a_residual_is_known_by_it(with_it, scatter, places):
    assert raised(left(100.0, 1000.0), left(*with_it, scatter)) == places
