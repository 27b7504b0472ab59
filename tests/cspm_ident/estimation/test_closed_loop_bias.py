"""A winch whose controller feeds encoder noise back: what is biased, and what is not."""

import numpy as np
import pytest
from estimation_samples import first_order
from scipy.stats import binom
from winch_samples import EFFECTS, Winch, closed_loop

from cspm_ident.estimation import Interval, Parameter, Problem, Record, fit, fit_instruments
from cspm_ident.winch import identify_winch
from cspm_msgs_py.errors import InputError

WINCH = Winch()
# What a designer would simulate before anything was identified: a fifth to a third off.
NOMINAL = Winch(2.0e-3, 4.0e-3, 0.04, 0.0)
NOISE = 1e-3  # rad, of the encoder
PAIR = [Parameter("a", "1", scale=1.0), Parameter("b", "1", scale=1.0)]
SHORT = {"half_width": 0.004, "band": 100.0}


@pytest.fixture(scope="module")
def noisy():
    return closed_loop(WINCH, 8000, noise=NOISE, seed=1)


@pytest.fixture(scope="module")
def simulated():
    return closed_loop(NOMINAL, 8000)


def deviation(found):
    return (found.estimate.values - WINCH.values) / found.estimate.sd


def test_least_squares_is_biased_and_instruments_are_not(noisy, simulated):
    plain = identify_winch([noisy], EFFECTS, **SHORT)
    lower, upper = plain.estimate.interval("inertia")
    assert upper < WINCH.inertia
    assert deviation(plain)[0] < -6.0
    ours = identify_winch([noisy], EFFECTS, instruments=[simulated], **SHORT)
    assert np.all(np.abs(deviation(ours)) < 3.5)
    # The interval is short enough to see the bias that it does not have.
    assert ours.estimate.sd[0] < 0.1 * (WINCH.inertia - 0.5 * (lower + upper))
    assert ours.exogeneity.p_value < 1e-6
    assert ours.exogeneity.degrees_of_freedom == 3


def test_instruments_hold_in_every_run(simulated):
    """Eight noises: the mean is off by no more than chance, for least squares by far more."""
    runs = [closed_loop(WINCH, 8000, noise=NOISE, seed=seed) for seed in range(10, 18)]
    kinds = {"interval": Interval.SANDWICH, **SHORT}
    ours = [deviation(identify_winch([r], EFFECTS, instruments=[simulated], **kinds)) for r in runs]
    plain = [deviation(identify_winch([r], EFFECTS, **kinds)) for r in runs]
    # Means of eight have a standard deviation of 0.35; four parameters.
    assert np.abs(np.mean(ours, axis=0)).max() < 1.3
    assert np.mean(plain, axis=0)[0] < -6.0


def test_without_noise_in_the_angle_least_squares_is_right():
    """Torque read with noise only: the test that found the bias is silent."""
    nominal = closed_loop(NOMINAL, 6000)
    p_values = [
        identify_winch(
            [closed_loop(WINCH, 6000, torque_noise=0.05, seed=seed)],
            EFFECTS,
            instruments=[nominal],
            interval=Interval.SANDWICH,
        ).exogeneity.p_value
        for seed in range(8)
    ]
    # Eight uniform numbers have a median below 0.1 with a chance of 5e-3.
    assert np.median(p_values) > 0.1


def test_the_test_for_bias_errs_as_often_as_it_says():
    """Coloured noise that the regressors do not feel: 5 % of runs are rejected, intervals hold."""
    rejected = inside = 0
    for seed in range(60):
        rng = np.random.default_rng([8, seed])
        regressors = np.stack([first_order(rng, 800, d, 1.0) for d in (0.95, 0.9)], axis=1)
        extra = np.stack([first_order(rng, 800, 0.8, 0.5) for _ in range(2)], axis=1)
        target = regressors @ [1.0, 2.0] + first_order(rng, 800, 0.8, 0.5)
        made = Record(target, regressors, instruments=regressors + extra)
        found = fit_instruments([made], PAIR)
        rejected += found.exogeneity.p_value < 0.05
        low, high = found.solution.estimate.interval("b")
        inside += low < 2.0 < high
    assert rejected <= binom.ppf(1.0 - 1e-3, 60, 0.05)
    assert inside >= binom.ppf(1e-3, 60, 0.9)


@pytest.mark.slow
def test_output_error_of_the_closed_loop_is_unbiased():
    """The loop is simulated with its controller, so that noise has no way into the regressors."""
    made = closed_loop(WINCH, 3000, noise=5.0 * NOISE, seed=3)
    measured = made.angle.values[:, 0]

    def residual(theta):
        model = closed_loop(Winch(theta[0], theta[1], theta[2], -theta[3]), 3000)
        return [measured - model.angle.values[:, 0]]

    chosen = [
        Parameter("inertia", "kg·m²", 1e-3, 6e-3, 1e-3),
        Parameter("viscous", "N·m·s/rad", 0.0, 0.03, 5e-3),
        Parameter("coulomb", "N·m", 0.0, 0.2, 0.05),
        Parameter("offset", "N·m", -0.1, 0.1, 0.05),
    ]
    # Sticking makes the simulation kinked: steps must be wider than its instants are sharp.
    problem = Problem(residual, chosen, step=1e-2)
    found = fit(problem, NOMINAL.values, iterations=2)
    assert np.all(np.abs(deviation(found)) < 3.5)
    plain = identify_winch([made], EFFECTS, **SHORT)
    assert plain.estimate.interval("inertia")[1] < WINCH.inertia
    assert found.estimate.sd[0] < 0.1 * WINCH.inertia


def test_instruments_that_say_nothing_are_weak():
    rng = np.random.default_rng(5)
    regressors = rng.standard_normal((2000, 2))
    target = regressors @ [1.0, -1.0] + 0.1 * rng.standard_normal(2000)
    good = np.column_stack([regressors[:, 0], regressors[:, 1] + rng.standard_normal(2000)])
    bad = np.column_stack([regressors[:, 0], rng.standard_normal(2000)])
    strong = fit_instruments([Record(target, regressors, instruments=good)], PAIR)
    weak = fit_instruments([Record(target, regressors, instruments=bad)], PAIR)
    assert strong.strength.min() > 500.0
    assert weak.strength[1] < 10.0 < weak.strength[0]
    assert weak.solution.estimate.sd[1] > 5.0 * strong.solution.estimate.sd[1]


def test_regressors_that_are_their_own_instruments_give_least_squares():
    rng = np.random.default_rng(6)
    regressors = rng.standard_normal((500, 2))
    target = regressors @ [1.0, -1.0] + 0.1 * rng.standard_normal(500)
    found = fit_instruments([Record(target, regressors, instruments=regressors)], PAIR, max_order=0)
    expected = np.linalg.lstsq(regressors, target, rcond=None)[0]
    np.testing.assert_allclose(found.solution.estimate.values, expected, rtol=1e-9)
    assert found.exogeneity == (0.0, 0, 1.0)


def test_too_few_instruments_are_refused():
    for instruments in (None, np.ones((9, 1))):
        with pytest.raises(InputError, match=r"has [01] instruments for 2 parameters; allowed: at"):
            fit_instruments([Record(np.ones(9), np.ones((9, 2)), instruments=instruments)], PAIR)
