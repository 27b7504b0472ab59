"""Least squares from sums of products: the same as from the rows, and honest about chance."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_comparison import paired
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 1.0
PLACE = Place(Channel.SHAFT, "only")
NAMES = ("winch_coulomb_friction", "winch_viscous_friction", "winch_torque_offset")
FIRST, SECOND, THIRD = (Candidate(catalogue()[name], "only") for name in NAMES)


def made(seed=0, weights=(0.3, -2.0, 0.0), colour=0.9, start=0):
    """An equation with three columns of different size and coloured noise; the rows with it."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((ROWS, 3)) * (1.0, 100.0, 1e-3)
    noise = rng.standard_normal(ROWS)
    for k in range(1, ROWS):
        noise[k] += colour * noise[k - 1]
    acting = np.arange(ROWS) >= start
    target = (columns @ weights) * acting + noise
    shaped = {c: columns[:, None, k : k + 1] for k, c in enumerate((FIRST, SECOND, THIRD))}
    times = STEP * np.arange(ROWS)
    equation = Equation(PLACE, times, target[:, None], shaped, target[:, None])
    return equation, columns, target


def sums_of(equation):
    gram = gather([[equation]], BLOCK_S)
    return gram, BlockRegression(gram)


def test_weights_and_what_is_left_are_those_of_the_rows():
    equation, columns, target = made()
    gram, sums = sums_of(equation)
    expected, left = np.linalg.lstsq(columns, target, rcond=None)[:2]
    own = np.arange(3)
    np.testing.assert_allclose(sums.weights(own), expected, rtol=1e-9)
    assert sums.squares_of(own) == pytest.approx(left[0], rel=1e-9)
    assert sums.squares == pytest.approx(target @ target)
    assert gram.left(own, expected)[PLACE] == pytest.approx(left[0], rel=1e-9)
    given = {FIRST: expected[:1], SECOND: expected[1:2], THIRD: expected[2:]}
    assert gram.left_with(given)[PLACE] == pytest.approx(left[0], rel=1e-9)


def test_gains_beyond_a_base_are_differences_of_fits():
    sums = sums_of(made()[0])[1]
    base = np.array([0])
    gains = sums.gains_beyond(base, [np.array([1]), np.array([1, 2])])
    alone = sums.squares_of(base)
    for gain, columns in zip(gains, ([0, 1], [0, 1, 2]), strict=True):
        assert gain == pytest.approx(alone - sums.squares_of(np.array(columns)), rel=1e-6)


def test_what_is_held_out_was_not_fitted():
    """By hand: each sixth predicted from the rest without the neighbouring blocks."""
    equation, columns, target = made()
    sums = sums_of(equation)[1]
    home = np.searchsorted(np.arange(sums.blocks), equation.times / BLOCK_S, side="right") - 1
    found = sums.held_out(np.arange(3))
    for fold in np.array_split(np.arange(sums.blocks), 6):
        far = (home < fold[0] - 1) | (home > fold[-1] + 1)
        fitted = np.linalg.lstsq(columns[far], target[far], rcond=None)[0]
        for block in fold:
            here = home == block
            left = target[here] - columns[here] @ fitted
            assert found[block] == pytest.approx(left @ left, rel=1e-6)


def test_what_is_not_there_gains_nothing_and_what_is_there_does():
    sums = sums_of(made()[0])[1]
    assert sums.gain(np.array([0]), np.array([1])).total > 0.0
    assert sums.gain(np.array([0, 1]), np.array([2])).total < 0.0
    assert sums.p_value(np.array([0]), np.array([1])) < 1e-6
    assert sums.p_value(np.array([0, 1]), np.array([2])) > 1e-3


def in_few_blocks(blocks, seed=0, weight=0.0):
    """A column that acts in some blocks only, beside one that acts always."""
    equation, columns, _ = made(seed, (0.3, 0.0, weight))
    home = (equation.times / BLOCK_S).astype(int)
    few = columns[:, 2] * np.isin(home, blocks)
    target = equation.target[:, 0] - weight * (columns[:, 2] - few)
    shaped = equation.columns | {THIRD: few[:, None, None]}
    return sums_of(replace(equation, target=target[:, None], columns=shaped))[1]


def test_a_few_blocks_that_agree_are_enough_and_a_single_one_is_not():
    base, own = np.array([0]), np.array([2])
    assert in_few_blocks([3, 9, 15, 21], weight=3e5).p_value(base, own) < 1e-4
    assert in_few_blocks([9], weight=3e5).p_value(base, own) > 0.5


def with_a_start(seed=0, at_start=0.0, afterwards=0.0, tail=1.0):
    """A column whose first block shows more than all others, and its weights there and later.

    The second block is `tail` times as loud as those after it.
    """
    equation, columns, _ = made(seed, (0.3, 0.0, 0.0))
    since = equation.times - equation.times[0]
    first = since < BLOCK_S
    loud = np.select([first, since < 2.0 * BLOCK_S], [40.0 * tail, tail], 1.0)
    violent = loud * columns[:, 2]
    target = equation.target[:, 0] + np.where(first, at_start, afterwards) * violent
    shaped = equation.columns | {THIRD: violent[:, None, None]}
    return sums_of(replace(equation, target=target[:, None], columns=shaped))[1]


def test_a_violent_start_hides_nothing_of_what_goes_on_afterwards():
    base, own = np.array([0]), np.array([2])
    assert with_a_start(at_start=2e3, afterwards=4e3).p_value(base, own) < 1e-6
    assert with_a_start(at_start=4e3, afterwards=0.0).p_value(base, own) > 1e-2
    assert with_a_start(at_start=2e3, afterwards=4e3, tail=40.0).p_value(base, own) < 1e-6


@pytest.mark.parametrize("tail", [1.0, 40.0])
def test_chance_is_reported_as_promised_beside_a_violent_start(tail):
    """Of 200 absent effects at most 20 may look present at 5 %, by the binomial at 1e-3."""
    base, own = np.array([0]), np.array([2])
    false = [with_a_start(seed, tail=tail).p_value(base, own) < 0.05 for seed in range(200)]
    assert sum(false) <= 20


@pytest.mark.parametrize("blocks", [[3, 9], [3, 9, 15, 21]])
def test_chance_is_reported_as_promised_for_what_acts_in_few_blocks(blocks):
    """Of 200 absent effects at most 20 may look present at 5 %, by the binomial at 1e-3."""
    base, own = np.array([0]), np.array([2])
    false = [in_few_blocks(blocks, seed).p_value(base, own) < 0.05 for seed in range(200)]
    assert sum(false) <= 20


@pytest.mark.parametrize("colour", [0.0, 0.95])
def test_chance_is_reported_as_often_as_promised(colour):
    """Of 200 absent effects 5 % may look present at 5 %: at most 20, by the binomial at 1e-3."""
    base, own = np.array([0, 1]), np.array([2])
    false = [
        sums_of(made(seed, colour=colour)[0])[1].p_value(base, own) < 0.05 for seed in range(200)
    ]
    assert sum(false) <= 20


def test_intervals_hold_for_coloured_noise():
    """95 % of 200; fewer than 178 would be a chance of 1e-4."""
    inside = 0
    for seed in range(200):
        sums = sums_of(made(seed, colour=0.95)[0])[1]
        own = np.arange(3)
        apart = abs(sums.weights(own)[0] - 0.3)
        inside += apart <= sums.half_width(own[1:], own[:1])[0]
    assert 178 <= inside <= 200


def test_intervals_hold_and_end_for_columns_that_resemble_each_other():
    """A speed and what grows with time in proportion to it, as a late clock and a fast one do.

    Of 200 numbers 95 %; fewer than 178 would be a chance of 1e-4.
    """
    own, times, inside = np.array([0, 1]), STEP * np.arange(ROWS), 0
    for seed in range(100):
        equation = made(seed, (0.0, 0.0, 0.0))[0]
        speed = np.convolve(equation.columns[FIRST][:, 0, 0], np.ones(51), "same")
        fast = speed * (times + 20.0)
        columns = {FIRST: speed[:, None, None], SECOND: fast[:, None, None]}
        sums = sums_of(replace(equation, columns=columns))[1]
        half = sums.half_width(np.arange(0), own)
        assert np.all(np.isfinite(half))
        inside += np.count_nonzero(np.abs(sums.weights(own)) <= half)
    assert 178 <= inside <= 200


def test_intervals_hold_for_what_wanders_for_longer_than_blocks():
    """A constant beside a wind of 3 s in blocks of 1 s, 24 s long."""
    inside = 0
    for seed in range(200):
        equation = made(seed, (0.0, 0.0, 0.0), colour=1.0 - STEP / 3.0)[0]
        steady = replace(equation, columns=equation.columns | {FIRST: np.ones((ROWS, 1, 1))})
        sums = sums_of(steady)[1]
        own = np.arange(3)
        inside += abs(sums.weights(own)[0]) <= sums.half_width(own[1:], own[:1])[0]
    assert 170 <= inside <= 200


def test_an_onset_leaves_least_where_it_is():
    equation = made(weights=(3.0, 0.0, 0.0), start=ROWS // 2)[0]
    sums = sums_of(equation)[1]
    left = sums.left_from(np.array([1]), np.array([0]))
    assert int(np.argmin(left)) == sums.blocks // 2
    assert left[0] == pytest.approx(sums.squares_of(np.array([0, 1])), rel=1e-9)


def test_delayed_columns_act_from_a_block_on():
    gram, sums = sums_of(made(weights=(3.0, 0.0, 0.0), start=ROWS // 2)[0])
    base, own, block = np.array([1]), np.array([0]), sums.blocks // 2
    both = np.concatenate([base, own])
    later, known = sums.delayed(own, block), gram.delayed(own, block)
    assert later.squares_of(both) == pytest.approx(sums.left_from(base, own)[block])
    assert later.squares_of(both) < sums.squares_of(both)
    assert later.held_out(both).sum() < sums.held_out(both).sum()
    left = known.left(both, later.weights(both))[PLACE]
    assert left == pytest.approx(later.squares_of(both))
    assert left == pytest.approx(known.left_by_block(both, later.weights(both))[PLACE].sum())


def test_what_is_delayed_is_a_regression_of_its_own():
    """As if the column had been zero before, in all that follows from the sums."""
    equation = made(weights=(3.0, 0.0, 0.0), start=ROWS // 2)[0]
    gram, sums = sums_of(equation)
    blocks, both = sums.blocks, np.array([0, 1, 2])
    before = [sums.weights(both), sums.held_out(both), sums.covariance(both[:1], both[1:])]
    twice = sums.delayed(both[:1], 3).delayed(both[1:2], blocks // 2).delayed(both[:1], 5)
    term, *others = equation.columns
    begins = {term: 5} | {other: blocks // 2 * (k == 0) for k, other in enumerate(others)}
    edge = np.arange(ROWS) * blocks // ROWS
    cut = {
        each: np.where((edge >= begins[each])[:, None, None], values, 0.0)
        for each, values in equation.columns.items()
    }
    alone = sums_of(replace(equation, columns=cut))[1]
    np.testing.assert_allclose(twice.weights(both), alone.weights(both), rtol=1e-9)
    np.testing.assert_allclose(twice.held_out(both), alone.held_out(both), rtol=1e-9)
    assert twice.squares_of(both) == pytest.approx(alone.squares_of(both), rel=1e-9)
    after = [sums.weights(both), sums.held_out(both), sums.covariance(both[:1], both[1:])]
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)
    assert sums.delayed(both, 0) is sums
    assert gram.delayed(np.array([], dtype=int), 4).places == gram.places


def test_weights_beyond_a_base_leave_the_base_as_it_is():
    _, columns, target = made()
    sums = sums_of(made()[0])[1]
    first = np.linalg.lstsq(columns[:, :1], target, rcond=None)[0]
    expected = np.linalg.lstsq(columns[:, 1:], target - columns[:, :1] @ first, rcond=None)[0]
    found = sums.weights_beyond(np.array([0]), np.array([1, 2]))
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_columns_that_others_span_are_known():
    equation = made()[0]
    doubled = dict(equation.columns) | {THIRD: 2.0 * equation.columns[FIRST]}
    same = Equation(PLACE, equation.times, equation.target, doubled, equation.measured)
    sums = sums_of(same)[1]
    assert sums.spanned(np.array([1]), np.array([2]), np.array([0]))[0] > 0.999
    other = sums_of(equation)[1]
    assert other.spanned(np.array([1]), np.array([2]), np.array([0]))[0] < 0.1


def test_nuisance_is_fitted_wherever_a_model_is_judged():
    equation, _, target = made()
    start = np.ones((ROWS, 1, 1))
    shifted = Equation(
        PLACE, equation.times, equation.target + 50.0, equation.columns, equation.measured, start
    )
    gram = gather([[shifted]], BLOCK_S)
    flat = target + 50.0
    assert gram.left_with({})[PLACE] == pytest.approx(np.sum((flat - flat.mean()) ** 2))


def test_combined_columns_are_as_if_they_had_been_there():
    equation, columns, _ = made()
    sums = sums_of(equation)[1]
    turn = np.array([[1.0], [0.02], [0.0]])
    wider = sums.beside(turn)
    shaped = equation.columns | {
        Candidate(FIRST.effect, "other"): (columns @ turn)[:, None, :],
    }
    directly = sums_of(replace(equation, columns=shaped))[1]
    both = np.array([2, 3])
    np.testing.assert_allclose(wider.weights(both), directly.weights(both), rtol=1e-9)
    for base, own in ((both[:1], both[1:]), (both[1:], both[:1])):
        width = directly.half_width(base, own)
        np.testing.assert_allclose(wider.half_width(base, own), width, rtol=1e-6)


def test_a_weight_beside_a_column_like_its_own_is_less_sure():
    equation, columns, _ = made()
    rng = np.random.default_rng(4)
    near = columns[:, :1] + 0.3 * rng.standard_normal((ROWS, 1))
    shaped = equation.columns | {Candidate(FIRST.effect, "other"): near[:, None, :]}
    sums = sums_of(replace(equation, columns=shaped))[1]
    own, far, close = np.array([0]), np.array([1]), np.array([1, 3])
    assert sums.half_width(close, own)[0] > 2.0 * sums.half_width(far, own)[0]


def test_what_a_single_block_shows_has_no_interval():
    base, own = np.array([0]), np.array([2])
    assert np.isinf(in_few_blocks([9]).half_width(base, own)[0])
    assert np.isfinite(in_few_blocks([3, 9]).half_width(base, own)[0])


def test_a_weight_that_drifts_is_distinguished_from_one_that_does_not():
    equation, columns, _ = made(weights=(3.0, 0.0, 0.0))
    steady = sums_of(equation)[1]
    ramp = np.linspace(0.0, 2.0, ROWS)
    target = equation.target[:, 0] + 3.0 * (ramp - 1.0) * columns[:, 0]
    drifting = sums_of(replace(equation, target=target[:, None]))[1]
    base, own = np.array([1]), np.array([0])
    gain, p_value = drifting.drift(base, own)
    assert p_value < 1e-6
    # A ramp from nothing to twice the mean has a third of the mean's squares beyond it; what was
    # fitted elsewhere misses more.
    assert gain.total > drifting.gain(base, own).total / 3.0
    gain, p_value = steady.drift(base, own)
    assert p_value > 0.01
    assert gain.total < 0.01 * steady.gain(base, own).total


def test_what_drifts_is_not_determined_by_other_columns():
    """The base has its own weight; only the columns asked about change."""
    equation, columns, _ = made(weights=(3.0, -2.0, 0.0))
    target = equation.target[:, 0] + np.linspace(-0.02, 0.02, ROWS) * columns[:, 1]
    sums = sums_of(replace(equation, target=target[:, None]))[1]
    assert sums.drift(np.array([0]), np.array([1]))[1] < 0.01
    assert sums.drift(np.array([1]), np.array([0]))[1] > 0.01


@pytest.mark.parametrize("count", [1, 2, 5, 6])
def test_blocks_are_joined_two_by_two(count):
    values = 2.0 ** np.arange(count)
    joined = paired(values)
    assert len(joined) == -(-count // 2)
    assert joined.sum() == values.sum()
    assert joined[0] == values[:2].sum()


def test_a_combination_that_is_nothing_shows_nothing():
    """Three times a column less the same, whose squares are rounded to less than none."""
    equation = made(seed=7)[0]
    threefold = equation.columns | {THIRD: 3.0 * equation.columns[FIRST]}
    sums = sums_of(replace(equation, columns=threefold))[1]
    turned = sums.beside(np.array([[3.0], [0.0], [-1.0]]))
    assert np.all(np.isfinite(turned.weights(np.arange(4))))
