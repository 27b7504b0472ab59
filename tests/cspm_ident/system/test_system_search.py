"""Steps of the search, on models that are linear or nearly so."""

import numpy as np
import pytest

from cspm_ident.estimation import Parameter, Prior, Problem
from cspm_ident.system.search import bounded_step

TIME = np.linspace(0.0, 1.0, 5000)


def line(slope, offset, parameters, noise=0.0):
    """Return a line to be fitted, and 1 % noise of a fixed pattern."""
    target = slope * TIME + offset + noise * np.cos(40.0 * TIME)

    def residual(theta):
        return [(target - theta[0] * TIME - theta[1])[:, None]]

    return Problem(residual, parameters)


BOUNDED = (Parameter("slope", "1", 0.0, 5.0, 1.0), Parameter("offset", "1", 0.0, 5.0, 1.0))


def test_a_parameter_on_its_bound_leaves_it_in_one_step():
    """But for the hold of one scale, by which it is a little short."""
    step, share = bounded_step(line(2.0, 1.0, BOUNDED), np.zeros(2), np.zeros(2))
    assert share == 1.0
    assert step == pytest.approx([2.0, 1.0], rel=0.02)
    assert step[0] < 2.0


def test_a_step_ends_on_the_bound_and_the_others_make_the_best_of_it():
    """With no offset below 0 allowed, the slope is that of a line through the origin."""
    held = np.array([1.9, 0.0])
    step, share = bounded_step(line(2.0, -0.1, BOUNDED), np.array([0.5, 0.5]), held)
    assert share == 1.0
    assert 0.5 + step[1] == pytest.approx(0.0, abs=1e-12)
    through_origin = 2.0 - 0.1 * TIME.sum() / (TIME @ TIME)
    assert 0.5 + step[0] == pytest.approx(through_origin, abs=0.01)


def test_what_is_hardly_seen_is_held_the_stronger_the_worse_the_fit():
    """A parameter of which all that is seen could be misfit moves less than its scale."""
    parameters = (Parameter("seen", "1", scale=1.0), Parameter("hidden", "1", scale=1.0))
    found = []
    for misfit in (0.0, 100.0):

        def residual(theta, misfit=misfit):
            slow = theta[0] - 1.0 + misfit * np.cos(40.0 * TIME)
            return [(slow + 0.05 * (theta[1] - 20.0) * TIME**8)[:, None]]

        step, _ = bounded_step(Problem(residual, parameters), np.ones(2), np.zeros(2))
        found.append(abs(1.0 + step[1]))
    assert found[0] > 5.0
    assert found[1] < 0.1


def test_a_step_too_far_is_shortened_and_one_without_advance_is_not_taken():
    """The arc tangent's full step from 3 leads further away than it began; a wrong slope never."""
    parameter = (Parameter("x", "1", scale=100.0),)
    problem = Problem(lambda theta: [np.full((40, 1), 50.0 * np.arctan(theta[0]))], parameter)
    step, share = bounded_step(problem, np.array([3.0]), np.zeros(1))
    assert 3.0 + step[0] < -3.0
    assert 0.0 < share < 1.0
    assert abs(3.0 + share * step[0]) < 3.0
    wrong = Problem(problem.residual, parameter, jacobian=lambda theta: [-np.ones((40, 1, 1))])
    assert bounded_step(wrong, np.array([3.0]), np.zeros(1))[1] == 0.0


def test_frozen_parameters_stand_and_priors_pull():
    parameters = (
        Parameter("slope", "1", 0.0, 5.0, 1.0, frozen=True),
        Parameter("offset", "1", 0.0, 5.0, 1.0, prior=Prior(4.0, 1e-4)),
    )
    step, _ = bounded_step(line(2.0, 1.0, parameters), np.array([2.0, 1.0]), np.array([2.0, 1.0]))
    assert step[0] == 0.0
    assert 1.0 + step[1] == pytest.approx(4.0, abs=1e-3)
