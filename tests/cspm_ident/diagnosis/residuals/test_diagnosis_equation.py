"""Equations that are cut, scaled and weighted hold their columns once, and mean the same."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel

PLACE = Place(Channel.SHAFT, "one")
FIRST, SECOND = Driver(PLACE, "speed"), Driver(PLACE, "angle")


@pytest.fixture
def equation():
    generator = np.random.default_rng(3)
    columns = {FIRST: generator.normal(size=(40, 1, 3)), SECOND: generator.normal(size=(40, 1, 2))}
    turning = np.zeros(40, dtype=bool)
    turning[::4] = True
    target = generator.normal(size=(40, 1))
    return Equation(PLACE, 0.1 * np.arange(40), target, columns, target + 1.0, turning=turning)


def test_cut_scaled_and_weighted_columns_follow_their_target(equation):
    """Whatever is done to the rows, target and columns still say the same of the weights."""
    weights = np.array([0.4, -1.0, 2.0])
    solved = equation.columns[FIRST] @ weights
    reported = Equation(
        PLACE, equation.times, solved, equation.columns, solved, turning=equation.turning
    )
    made = reported.within(0.55, 3.05).steady.scaled(np.array([0.2]))
    made = made.weighted(np.linspace(0.5, 2.0, len(made.times)))
    assert made.columns[FIRST].shape == (len(made.times), 1, 3)
    assert np.allclose(made.columns[FIRST] @ weights, made.target)
    assert made.times[0] >= 0.55
    assert made.times[-1] < 3.05


def test_a_cut_takes_no_memory_for_columns(equation):
    part = equation.within(1.0, 2.0)
    assert np.shares_memory(part.columns[FIRST], equation.columns[FIRST])
    assert list(part.times) == [t for t in equation.times if 1.0 <= t < 2.0]


def test_columns_that_are_not_asked_for_are_let_go(equation):
    made = equation.steady
    assert FIRST in made.columns
    assert len(made.columns) == 2
    left = made.only([SECOND])
    assert list(left.columns) == [SECOND]
    assert Driver(PLACE, "other") not in left.columns


def test_compact_columns_take_half_the_memory_and_say_the_same(equation):
    made = equation.compact
    assert made.columns[FIRST].nbytes == equation.columns[FIRST].nbytes // 2
    assert made.scaled(np.array([0.2])).columns[FIRST].dtype == np.float64
    assert np.allclose(made.columns[FIRST], equation.columns[FIRST], rtol=1e-7, atol=0.0)


@pytest.mark.parametrize(("large", "marked"), [(3, True), (12, False)])
def test_rows_with_a_snap_are_marked_unless_all_motion_is_snaps(equation, large, marked):
    errors = np.full(40, 0.5 * equation.noise[0])
    errors[5 : 5 + large] = -2.0 * equation.noise[0]
    made = replace(equation, turning=np.zeros(40, dtype=bool)).without_snaps(errors, most=0.1)
    assert made.turning.sum() == (large if marked else 0)
    assert len(made.steady.times) == 40 - made.turning.sum()
    if marked:
        assert not set(made.steady.times) & set(equation.times[5 : 5 + large])
    errors[0] = np.nan
    assert not marked or replace(equation).without_snaps(errors, most=0.1).turning[0]
