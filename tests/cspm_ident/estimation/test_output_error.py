from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from estimation_samples import first_order, parameters, records
from scipy.integrate import solve_ivp

from cspm_ident.estimation import Interval, Parameter, Prior, Problem, Record, fit, fit_linear
from cspm_msgs_py.errors import InputError


def linear_problem(made, chosen, **changes):
    return Problem(
        lambda theta: [(r.target - r.regressors @ theta)[:, 0] for r in made], chosen, **changes
    )


@pytest.mark.parametrize("whiten", [True, False])
def test_a_linear_model_gives_what_linear_regression_gives(whiten):
    """Two roads: differences and a solver, against one decomposition."""
    made = records(np.random.default_rng(1))
    straight = fit_linear(made, parameters(), whiten=whiten).estimate
    found = fit(linear_problem(made, parameters()), np.zeros(3), whiten=whiten).estimate
    # Both stop when the values move by less than a hundredth of a standard deviation.
    assert np.all(np.abs(found.values - straight.values) < 0.03 * straight.sd)
    np.testing.assert_allclose(found.sd, straight.sd, rtol=0.01)
    np.testing.assert_allclose(found.ci95, straight.ci95, atol=0.05 * straight.sd.max())
    assert found.effective_samples == pytest.approx(straight.effective_samples, rel=0.02)


def decay(theta, times, start=1.0):
    return start * np.exp(-theta[0] * times) + theta[1]


def decay_problem(rng, chosen, deviation=0.01, **changes):
    """Two windows of a decay towards a level, from different starts."""
    times = np.arange(400) * 0.01
    truth = np.array([1.3, 0.2])
    measured = [decay(truth, times, s) + first_order(rng, 400, 0.9, deviation) for s in (1.0, -0.7)]

    def residual(theta):
        pairs = zip(measured, (1.0, -0.7), strict=True)
        return [data - decay(theta, times, start) for data, start in pairs]

    return Problem(residual, chosen, **changes)


DECAY = (Parameter("rate", "1/s", 0.0, 10.0, 1.0), Parameter("level", "m", -1.0, 1.0))


def test_supplied_and_parallel_jacobians_are_the_same():
    times = np.arange(400) * 0.01

    def jacobian(theta):
        return [
            np.stack([s * times * np.exp(-theta[0] * times), -np.ones(400)], axis=1)
            for s in (1.0, -0.7)
        ]

    usual = fit(decay_problem(np.random.default_rng(2), DECAY), [3.0, 0.0]).estimate
    given = decay_problem(np.random.default_rng(2), DECAY, jacobian=jacobian)
    with ThreadPoolExecutor(2) as pool:
        parallel = decay_problem(np.random.default_rng(2), DECAY, evaluate=pool.map)
        for problem in (given, parallel):
            found = fit(problem, [3.0, 0.0]).estimate
            np.testing.assert_allclose(found.values, usual.values, rtol=1e-5)
            np.testing.assert_allclose(found.sd, usual.sd, rtol=1e-3)


def test_differences_stay_within_the_bounds():
    """A model that does not exist beyond a bound is not asked there."""

    def residual(theta):
        assert theta[0] <= 2.0
        return [np.arange(1.0, 50.0) * (theta[0] - 3.0)]

    found = fit(Problem(residual, [Parameter("x", "1", 0.0, 2.0)]), [2.0]).estimate
    assert found.values[0] == pytest.approx(2.0)
    assert found.at_bound == ("x",)


def test_frozen_and_prior_as_in_regression():
    made = records(np.random.default_rng(3))
    chosen = parameters(slope={"frozen": True}, level={"prior": Prior(0.5, 0.02)})
    start = [0.0, -0.5, 0.0]
    straight = fit_linear(made, chosen, start).estimate
    found = fit(linear_problem(made, chosen), start).estimate
    assert found.value("slope") == -0.5
    assert np.all(np.abs(found.values - straight.values)[[0, 2]] < 0.03 * straight.sd[[0, 2]])
    free = fit(linear_problem(made, parameters()), np.zeros(3)).estimate
    assert free.value("level") < found.value("level") < 0.5
    assert found.sd[2] < free.sd[2]


def test_groups_have_their_own_noise():
    """Metres and newtons in one fit: the unit of a group does not matter."""
    rng = np.random.default_rng(4)
    pair = records(rng, (600,), deviation=0.02) + records(rng, (600,), deviation=0.3)

    def estimate(factor):
        scaled = [pair[0], Record(factor * pair[1].target, factor * pair[1].regressors)]
        problem = linear_problem(scaled, parameters(), groups=("fine", "coarse"))
        return fit(problem, np.zeros(3)).estimate

    plain, scaled = estimate(1.0), estimate(1000.0)
    np.testing.assert_allclose(scaled.values, plain.values, atol=0.05 * plain.sd.min())
    np.testing.assert_allclose(scaled.sd, plain.sd, rtol=0.01)


def test_channels_that_repeat_each_other_are_no_more_data():
    """The same noise in two channels: by default the interval stays that of one."""
    rng = np.random.default_rng(5)
    made = records(rng, (1500,))[0]
    shifted = Record(made.target + 1e-3 * rng.standard_normal((1500, 1)), made.regressors)
    doubled = Record(
        np.hstack([made.target, shifted.target]), np.concatenate([made.regressors] * 2, axis=1)
    )
    one = fit_linear([made], parameters(), interval=Interval.SANDWICH).estimate
    two = fit_linear([doubled], parameters()).estimate
    assert two.method.endswith("sandwich")
    np.testing.assert_allclose(two.sd, one.sd, rtol=0.2)


def test_a_simulated_pendulum_is_found_again():
    """Measured with a thousand times finer integration than the one that is fitted."""
    rng = np.random.default_rng(6)
    times = np.arange(0.0, 8.0, 0.02)

    def swing(theta, rtol):
        def rates(_, state):
            return [state[1], -theta[0] * np.sin(state[0]) - theta[1] * state[1]]

        return solve_ivp(rates, (0.0, 8.0), [0.8, 0.0], t_eval=times, rtol=rtol, atol=1e-9).y[0]

    truth = np.array([9.81, 0.15])
    measured = swing(truth, 1e-10) + first_order(rng, len(times), 0.8, 0.01)
    chosen = [Parameter("g/l", "1/s²", 1.0, 30.0, 5.0), Parameter("damping", "1/s", 0.0, 3.0)]
    problem = Problem(lambda theta: [measured - swing(theta, 1e-7)], chosen, step=1e-4)
    found = fit(problem, [8.5, 0.3], iterations=3).estimate
    assert np.all(np.abs(found.values - truth) < 3.5 * found.sd)
    assert np.all(found.sd < [0.1, 0.03])


@pytest.mark.parametrize(
    ("residual", "groups", "words"),
    [
        (lambda _: [np.array([np.nan])], None, "a residual has a number that is not finite"),
        (lambda _: [], None, "0 residuals in 0 groups; allowed: a group for each residual"),
        (lambda _: [np.zeros(3)], ("a", "b"), "1 residuals in 2 groups"),
        (
            lambda _: [np.zeros((3, 1)), np.zeros((3, 2))],
            None,
            "group '' has records of different numbers of channels; allowed: one number",
        ),
    ],
)
def test_what_does_not_fit_is_refused(residual, groups, words):
    with pytest.raises(InputError, match=words):
        fit(Problem(residual, [Parameter("x", "1", scale=1.0)], groups), [0.0])


def test_truth_is_within_three_and_a_half_deviations():
    found = fit(decay_problem(np.random.default_rng(7), DECAY), [3.0, 0.0]).estimate
    assert np.all(np.abs(found.values - [1.3, 0.2]) < 3.5 * found.sd)
