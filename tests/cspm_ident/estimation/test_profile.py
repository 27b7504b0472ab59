import numpy as np
import pytest
from estimation_samples import first_order, parameters, records

from cspm_ident.estimation import Interval, Parameter, Problem, find_profile, fit
from cspm_msgs_py.errors import ConvergenceError, InputError


def linear(made, chosen):
    return Problem(lambda theta: [r.target - r.regressors @ theta for r in made], chosen)


@pytest.mark.parametrize(
    ("whiten", "interval"),
    [(True, None), (False, Interval.SANDWICH), (True, Interval.BOOTSTRAP)],
)
def test_of_a_linear_model_it_is_the_interval(whiten, interval):
    """A parabola; coloured residuals that were not whitened raise its threshold."""
    made = records(np.random.default_rng(1), (900, 400))
    problem = linear(made, parameters())
    solution = fit(problem, np.zeros(3), whiten=whiten, interval=interval)
    found = find_profile(problem, solution, "gain")
    sd = solution.estimate.sd[0]
    # The ends are sought to a hundredth of a standard deviation.
    np.testing.assert_allclose(found.ci95, solution.estimate.interval("gain"), atol=0.05 * sd)
    squares = ((found.values - solution.estimate.values[0]) / sd) ** 2
    np.testing.assert_allclose(found.deviance, squares, atol=0.02 + 0.02 * squares.max())
    assert found.unit == "1"
    if not whiten:
        assert found.inflation > 4.0
    elif interval is None:
        assert found.inflation == pytest.approx(1.0, rel=1e-6)


def saturation(strength, chosen, deviation=0.02):
    """y = 1 − exp(−x·k) where k is so large that only a lower limit can be seen."""
    x = np.linspace(0.5, 3.0, 300)
    noise = first_order(np.random.default_rng(2), 300, 0.5, deviation)
    measured = 1.0 - np.exp(-strength * x) + noise
    return Problem(lambda theta: [measured - theta[1] * (1.0 - np.exp(-theta[0] * x))], chosen)


SATURATION = (Parameter("rate", "1/s", 0.1, 1000.0, 5.0), Parameter("height", "m", 0.0, 5.0, 1.0))


def test_one_side_is_open():
    """Any faster rate fits as well: the upper end is infinite, the lower one is not."""
    problem = saturation(20.0, SATURATION)
    solution = fit(problem, [8.0, 1.0])
    found = find_profile(problem, solution, "rate")
    assert found.ci95[1] == np.inf
    assert 1.0 < found.ci95[0] < 20.0
    assert found.deviance[-1] < found.threshold
    slow = saturation(1.0, SATURATION)
    both = find_profile(slow, fit(slow, [2.0, 1.0]), "rate")
    assert both.ci95[0] < 1.0 < both.ci95[1] < 2.0


def test_a_flat_profile_is_open_on_both_sides():
    x = np.sin(np.arange(300.0))
    measured = 6.0 * x + 0.1 * np.random.default_rng(3).standard_normal(300)
    chosen = [Parameter(name, "1", 0.01, 600.0, 1.0) for name in "ab"]
    problem = Problem(lambda theta: [measured - theta[0] * theta[1] * x], chosen)
    found = find_profile(problem, fit(problem, [2.0, 2.0]), "a")
    assert found.ci95 == (-np.inf, np.inf)
    assert found.deviance.max() < found.threshold


def test_a_single_parameter_has_a_profile():
    made = records(np.random.default_rng(4), (500,))
    chosen = parameters(slope={"frozen": True}, level={"frozen": True})
    problem = linear(made, chosen)
    solution = fit(problem, [0.0, -0.5, 0.3])
    found = find_profile(problem, solution, "gain")
    expected = solution.estimate.interval("gain")
    np.testing.assert_allclose(found.ci95, expected, atol=0.05 * solution.estimate.sd[0])


def test_an_unknown_or_frozen_name_is_refused():
    made = records(np.random.default_rng(4), (200,))
    problem = linear(made, parameters(slope={"frozen": True}))
    solution = fit(problem, [0.0, -0.5, 0.0])
    for name in ("slope", "mass"):
        with pytest.raises(InputError, match=f"profile of '{name}'; allowed: gain, level"):
            find_profile(problem, solution, name)


def test_a_better_fit_elsewhere_is_reported():
    """A valley, a low ridge, and a deeper valley behind it."""
    noise = np.random.default_rng(5).standard_normal(200)
    noise = (noise - noise.mean()) / noise.std()

    def residual(theta):
        ridge = 0.05 * np.exp(-(((theta[0] - 0.5) / 0.2) ** 2))
        return [noise + 0.12 / (1.0 + np.exp(10.0 * (theta[0] - 1.0))) + ridge]

    problem = Problem(residual, [Parameter("place", "1", -1.0, 2.0, 1.0)])
    solution = fit(problem, [-0.2], max_order=0)
    with pytest.raises(ConvergenceError, match=r"of place: a better fit at .*; start"):
        find_profile(problem, solution, "place")
    deeper = fit(problem, [1.4], max_order=0)
    assert find_profile(problem, deeper, "place").ci95[1] == np.inf
