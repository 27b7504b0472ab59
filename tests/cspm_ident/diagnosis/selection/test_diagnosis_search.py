"""What is chosen, from when on, how surely, and what is left for no effect."""

import numpy as np
import pytest
from scipy.stats import norm

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import at_once, weights_of
from cspm_ident.diagnosis.regression.parameter_estimates import of_shafts
from cspm_ident.diagnosis.reporting.formula_hint import sketch
from cspm_ident.diagnosis.residuals.free_shapes import KNOTS, Driver, Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.onset import onset_of
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.validation.detection_limits import detection_limits
from cspm_ident.diagnosis.validation.holdout_residuals import free_functions, rms
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
PLACE = Place(Channel.SHAFT, "only")
COULOMB, VISCOUS = (
    Candidate(catalogue()[name], "only")
    for name in ("winch_coulomb_friction", "winch_viscous_friction")
)
TORQUE = 0.3


def turning(seed=0, start=0, missing=None, sticks=False):
    """A shaft swinging against dry friction in noise, and rows in which it reverses."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    speed = np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times + seed)
    acting = times >= STEP * start
    slow = np.abs(speed) < 0.1
    friction = TORQUE * np.sign(speed) * acting
    if sticks:
        friction = np.where(slow, 0.2 * friction, friction)
    target = friction + 0.05 * rng.standard_normal(ROWS)
    if missing is not None:
        target = target + missing(speed)
    columns = {COULOMB: np.sign(speed), VISCOUS: speed}
    shaped = {term: values[:, None, None] for term, values in columns.items()}
    shaped |= Knots().columns(PLACE, {"speed [rad/s]": speed, "time [s]": times})
    return Equation(PLACE, times, target[:, None], shaped, target[:, None], turning=slow)


def found(equation):
    return Search(gather([[equation]], BLOCK_S)).run()


def test_an_effect_is_named_with_what_it_is_worth():
    (named,) = found(turning()).findings
    assert (named.hypothesis.effect.id, named.hypothesis.elements) == (
        "winch_coulomb_friction",
        ("only",),
    )
    assert named.hypothesis.onset == 0
    assert named.share > 0.9
    assert found(turning()).unexplained == ()


def test_an_effect_that_begins_late_is_named_with_when_it_began():
    equation = turning(start=3000)
    (named,) = found(equation).findings
    assert named.hypothesis.effect.id == "winch_coulomb_friction"
    assert named.hypothesis.onset == round(3000 * STEP / BLOCK_S)
    onset = onset_of([equation], [COULOMB], {}, 28.0, 32.0)
    assert onset.low < 3000 * STEP < onset.high
    assert onset.high - onset.low < 1.0
    assert onset.time == pytest.approx(3000 * STEP, abs=0.2)


def test_what_shows_at_the_very_end_only_is_not_reported():
    assert found(turning(start=ROWS - 500)).findings == ()


def test_nothing_is_named_in_noise():
    noise = np.random.default_rng(5).standard_normal((ROWS, 1))
    assert found(Equation(PLACE, turning().times, noise, turning().columns, noise)).findings == ()


def test_what_no_effect_does_is_a_free_function_of_its_driver():
    result = found(turning(missing=lambda speed: 0.1 * speed**2))
    assert [named.hypothesis.effect.id for named in result.findings] == ["winch_coulomb_friction"]
    driver, _, share, _ = result.unexplained[0]
    assert driver == Driver(PLACE, "speed [rad/s]")
    assert share > 0.5


def test_rows_that_stick_do_not_mislead_and_others_are_all_used():
    for sticks in (False, True):
        equation = turning(sticks=sticks)
        steady = gather([[equation.steady]], BLOCK_S)
        first = weights_of(steady, BlockRegression(steady), [COULOMB])
        (value,), (half,) = of_shafts(first, [[equation]], BLOCK_S)[COULOMB]
        assert abs(value - TORQUE) < half
    whole = gather([[turning(sticks=True)]], BLOCK_S)
    ((misled,), (half,)) = weights_of(whole, BlockRegression(whole), [COULOMB])[COULOMB]
    assert abs(misled - TORQUE) > half


def test_free_functions_leave_what_is_no_function_of_a_driver():
    first, second = turning(seed=1), turning(seed=2)
    gram, judge = (gather([[each]], BLOCK_S) for each in (first, second))
    left = free_functions(gram, judge)[PLACE]
    assert 0.05 < left < 0.5 * rms([second])


def test_knots_are_those_of_the_first_recording():
    knots = Knots()
    wide, narrow = np.linspace(-1.0, 1.0, 50), np.linspace(-0.2, 3.0, 50)
    knots.columns(PLACE, {"speed": wide})
    (columns,) = knots.columns(PLACE, {"speed": narrow}).values()
    at = knots.of(Driver(PLACE, "speed"))
    np.testing.assert_allclose(columns[:, 0] @ at, np.clip(narrow, -1.0, 1.0), atol=1e-12)
    assert len(at) == KNOTS
    assert knots.columns(PLACE, {"still": np.zeros(50)}) == {}


def test_an_effect_below_its_limit_is_not_reported_and_one_above_it_is():
    """The limit is that of the search itself, determined from a recording without the effect."""
    quiet = turning(missing=lambda speed: -TORQUE * np.sign(speed))
    search = Search(gather([[quiet]], BLOCK_S))
    limits = {limit.effect: limit for limit in detection_limits(search, ())}
    limit = limits["winch_coulomb_friction"]
    assert (limit.element, limit.parameter, limit.unit) == ("only", "torque", "N·m")
    assert limit.possible
    assert set(limits) == {"winch_coulomb_friction", "winch_viscous_friction"}
    for factor, reported in ((0.5, False), (2.0, True)):
        less = factor * limit.least - TORQUE
        found_here = found(turning(missing=lambda speed, less=less: less * np.sign(speed)))
        assert bool(found_here.findings) is reported


def test_what_is_never_reported_is_fitted_before_a_residual_counts():
    equation = turning()
    start = np.linspace(1.0, 2.0, ROWS)[:, None, None]
    shifted = Equation(
        PLACE,
        equation.times,
        equation.target + 7.0 * start[:, :, 0],
        equation.columns,
        equation.measured,
        nuisance=start,
    )
    left = shifted.left
    assert abs(float(left[:, 0] @ start[:, 0, 0])) < 1e-6 * ROWS
    assert rms([shifted]) <= rms([equation]) * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (lambda x: 2.0 * np.abs(x) - 0.3, "2·|speed|"),
        (lambda x: -0.5 * x**2, "-0.5·(speed)²"),
        (lambda x: 3.0 * x * np.abs(x), "3·speed·|speed|"),
        (lambda x: np.cos(3.0 * x), None),
        (lambda x: 0.0 * x, None),
    ],
)
def test_a_shape_is_put_into_a_formula_where_it_follows_one(shape, expected):
    knots = np.linspace(-2.0, 2.0, KNOTS)
    assert sketch(knots, shape(knots), "speed") == expected


def drifting(times):
    return 0.15 * np.sign(np.sin(5.0 * np.pi * times / 48.0))


def test_what_only_time_shows_is_unknown_though_no_other_block_foretells_it():
    equation = turning(missing=lambda speed: drifting(STEP * np.arange(ROWS)))
    reported = {driver.signal for driver, *_ in found(equation).unexplained}
    assert reported == {"time [s]"}


def test_a_wrong_number_of_the_file_does_not_begin():
    """A force that a wrong stiffness would make, but only later, is something else."""
    stiffness = Candidate(catalogue()["cable_stiffness"], "only")
    friction = Candidate(catalogue()["cable_hysteresis"], "only", (("displacement", 1e-3),))
    place = Place(Channel.TENSION, "only")
    rng, times = np.random.default_rng(5), STEP * np.arange(ROWS)
    column = np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times)
    target = 0.3 * column * (times > 24.0) + 0.05 * rng.standard_normal(ROWS)
    for term, begins in ((stiffness, False), (friction, True)):
        shaped = {term: column[:, None, None]}
        (named,) = found(Equation(place, times, target[:, None], shaped, target[:, None])).findings
        assert (named.hypothesis.onset > 0) is begins


BIAS, OFFSET = "tension_bias", "winch_torque_offset"


def several(elements, weights, seed=3, noise=0.05):
    """A residual per element, in which both effects do the same, with weights of what is there."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    equations = []
    for element, weight in zip(elements, weights, strict=True):
        column = np.sin(2.1 * times + rng.uniform(0.0, 6.0)) + 0.5
        target = weight * column + noise * rng.standard_normal(ROWS)
        columns = {
            Candidate(catalogue()[name], element): column[:, None, None] for name in (BIAS, OFFSET)
        }
        place = Place(Channel.SHAFT, element)
        equations.append(Equation(place, times, target[:, None], columns, target[:, None]))
    return equations


def test_more_elements_have_to_be_worth_it_whichever_effect_is_theirs():
    elements = ("surge_1", "surge_2", "sway_1", "sway_2")
    (named,) = (
        Search(gather([several(elements, (0.3, 0.004, 0.004, 0.004))], BLOCK_S)).run().findings
    )
    assert named.hypothesis.elements == ("surge_1",)
    (named,) = Search(gather([several(elements, (0.3, 0.3, 0.3, 0.3))], BLOCK_S)).run().findings
    assert named.hypothesis.elements == elements


def mixed(own):
    """Where one element's bias is, and what is like another's bias, but is an offset."""
    rng = np.random.default_rng(11)
    times = STEP * np.arange(ROWS)
    first, like = np.sin(2.1 * times), np.sin(1.3 * times) + 0.3
    other = like + 0.3 * rng.standard_normal(ROWS)
    target = 0.3 * first + 0.3 * (other if own else like) + 0.02 * rng.standard_normal(ROWS)
    columns = {(BIAS, "surge_1"): first, (BIAS, "surge_2"): other, (OFFSET, "surge_1"): like}
    shaped = {
        Candidate(catalogue()[name], element): values[:, None, None]
        for (name, element), values in columns.items()
    }
    return Equation(PLACE, times, target[:, None], shaped, target[:, None])


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        (False, {(BIAS, ("surge_1",)), (OFFSET, ("surge_1",))}),
        (True, {(BIAS, ("surge_1", "surge_2"))}),
    ],
)
def test_elements_that_another_effect_explains_are_left_out(own, expected):
    named = found(mixed(own)).findings
    assert {(n.hypothesis.effect.id, n.hypothesis.elements) for n in named} == expected


@pytest.mark.parametrize("count", [1, 8])
def test_intervals_at_once_hold_all_weights_in_nineteen_of_twenty(count):
    rng = np.random.default_rng(5)
    errors = rng.standard_normal((20_000, count))
    half = np.array([norm.isf(0.025)])
    many = [Candidate(catalogue()["winch_viscous_friction"], f"w{k}") for k in range(count)]
    wide = at_once({c: (np.zeros(1), half) for c in many})
    widths = np.array([wide[c][1][0] for c in many])
    assert np.all(np.abs(errors) < widths, axis=1).mean() == pytest.approx(0.95, abs=0.005)
    assert (widths[0] == half[0]) == (count == 1)
    assert at_once({}) == {}
