"""The gains of PD+ and LQR: poles, Riccati equation, the bar's inertia."""

import numpy as np
import pytest
from run_samples import bundle_of
from scipy.linalg import expm, solve_continuous_are

from cspm_control.design.state_feedback import (
    coordinate_inertia,
    design_feedback_gains,
    error_dynamics,
    lqr_gains,
    pd_gains,
)
from cspm_msgs_py.scenario import LqrControl, PdPlusControl

MASS, BANDWIDTH, TAU, PERIOD = 3.0, 7.3, 1.0, 0.01
CONTINUOUS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
COSTS = np.diag([TAU**-2, 1.0, 0.0]), (MASS * BANDWIDTH**2) ** -2


def row(gains):
    return np.array([[gains.ki, gains.kp, gains.kd]])


def test_the_error_s_dynamics_are_a_triple_integrator_held():
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[2, 3] = CONTINUOUS, 1.0 / MASS
    exact = expm(whole * PERIOD)
    transition, entry = error_dynamics(MASS, PERIOD)
    np.testing.assert_allclose(transition, exact[:3, :3], atol=1e-15)
    np.testing.assert_allclose(entry[:, 0], exact[:3, 3], atol=1e-15)


def test_pd_gains_put_both_poles_at_the_bandwidth():
    gains = pd_gains(MASS, BANDWIDTH)
    assert gains.ki == 0.0
    poles = np.roots([MASS, gains.kd, gains.kp])
    np.testing.assert_allclose(poles, -BANDWIDTH, rtol=1e-6)


@pytest.mark.parametrize("period", [0.001, 0.01, 0.05])
def test_the_lqr_gain_s_cost_solves_the_riccati_equation(period):
    """The cost is summed by Lyapunov's iteration, so that no Riccati solver checks itself."""
    gain = row(lqr_gains(MASS, BANDWIDTH, TAU, period))
    transition, entry = error_dynamics(MASS, period)
    closed, (state, effort) = transition - entry @ gain, COSTS
    step, cost = closed, state + effort * gain.T @ gain
    for _ in range(40):
        cost, step = cost + step.T @ cost @ step, step @ step
    cross = entry.T @ cost @ transition
    residual = (
        transition.T @ cost @ transition
        - cost
        - cross.T @ cross / (effort + entry.T @ cost @ entry)
        + state
    )
    np.testing.assert_allclose(residual, 0.0, atol=1e-8 * np.abs(cost).max())
    np.testing.assert_allclose(gain, cross / (effort + entry.T @ cost @ entry), rtol=1e-6)


@pytest.mark.parametrize("period", [0.001, 0.01, 0.05])
def test_the_lqr_closes_its_loop_within_the_unit_circle(period):
    gain = row(lqr_gains(MASS, BANDWIDTH, TAU, period))
    transition, entry = error_dynamics(MASS, period)
    assert np.abs(np.linalg.eigvals(transition - entry @ gain)).max() < 1.0
    # With the sign inverted it does not.
    assert np.abs(np.linalg.eigvals(transition + entry @ gain)).max() > 1.0


def test_a_fast_lqr_is_the_continuous_one():
    entry, (state, effort) = np.array([[0.0], [0.0], [1.0 / MASS]]), COSTS
    cost = solve_continuous_are(CONTINUOUS, entry, state, [[effort]])
    expected = entry.T @ cost / effort
    np.testing.assert_allclose(row(lqr_gains(MASS, BANDWIDTH, TAU, 1e-5)), expected, rtol=1e-3)
    assert np.linalg.eigvals(CONTINUOUS - entry @ expected).real.max() < 0.0


def test_lqr_gains_grow_with_the_inertia():
    heavy, light = (row(lqr_gains(mass, BANDWIDTH, TAU, PERIOD)) for mass in (6.0, 1.5))
    np.testing.assert_allclose(heavy, 4.0 * light, rtol=1e-6)


def test_the_inertia_is_the_bar_s_about_its_origin():
    testbed = bundle_of("rest").testbed.testbed
    com = np.array([0.1, 0.2, -0.3])
    shifted = testbed.model_copy(update={"bar": testbed.bar.model_copy(update={"com": tuple(com)})})
    mass, about = testbed.bar.mass, np.diag(testbed.bar.inertia.matrix)
    found = coordinate_inertia(shifted, np.zeros(6))
    expected = [*[mass] * 3, *(about + mass * (com @ com - com**2))]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("law", [PdPlusControl(law="pd_plus"), LqrControl(law="lqr")])
def test_each_dof_with_a_bandwidth_gets_gains_of_its_own_inertia(law):
    testbed = bundle_of("rest").testbed.testbed
    wanted = law.model_copy(update={"bandwidth": {"heave": 5.0, "yaw": 8.0}})
    gains = design_feedback_gains(wanted, testbed, PERIOD)
    inertia = coordinate_inertia(testbed, law.design_pose)
    assert list(gains) == ["heave", "yaw"]
    for dof, m, w in (("heave", inertia[2], 5.0), ("yaw", inertia[5], 8.0)):
        alone = pd_gains(m, w) if law.law == "pd_plus" else lqr_gains(m, w, 1.0, PERIOD)
        assert gains[dof] == alone
