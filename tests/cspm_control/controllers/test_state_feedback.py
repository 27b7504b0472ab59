"""PD+ and LQR: what they give without an error, and that they hold the bar."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cspm
from cspm_control.controllers.state_feedback import StateFeedback
from cspm_control.design.state_feedback import lqr_gains, pd_gains
from cspm_model.kernels.rows import pose_row
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Bar

MASS, GRAVITY, PERIOD, BANDWIDTH = 4.0, 9.81, 0.01, 7.3
INERTIA = {"ixx": 0.1, "iyy": 0.3, "izz": 0.4}
COM = np.array([0.02, -0.01, 0.03])
PLACE = np.array([0.1, -0.2, 2.0, 0.2, -0.1, 0.3])
STILL = np.zeros(12)
LAWS = {
    "pd_plus": (pd_gains(MASS, BANDWIDTH), (0.0, 0.0)),
    "lqr": (lqr_gains(MASS, BANDWIDTH, 1.0, PERIOD), (20.0, 5.0)),
}


def controller(law):
    gains, limits = LAWS[law]
    return StateFeedback(
        dict.fromkeys(DOFS, gains),
        Bar(mass=MASS, inertia=INERTIA, com=tuple(COM), dimensions=(1.0, 0.1, 0.1)),
        GRAVITY,
        period=PERIOD,
        derivative_filter=200.0,
        integral_limits=limits,
    )


def pose(values=PLACE):
    row = np.empty(7)
    pose_row(np.array(values, dtype=float), row)
    return row


def reference(motion=STILL, values=PLACE):
    return np.concatenate([pose(values), motion])


def arm():
    """The centre of mass from the bar's origin in world axes, by scipy's rotations [m]."""
    return Rotation.from_quat(pose()[3:7]).apply(COM)


@pytest.mark.parametrize("law", LAWS)
def test_at_rest_on_the_reference_it_is_gravity_compensation(law):
    found = controller(law)
    lift = np.array([0.0, 0.0, -MASS * GRAVITY])
    for _ in range(5):
        wrench = found.step(pose(), reference())
        np.testing.assert_allclose(wrench, [*lift, *np.cross(arm(), lift)], atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_the_reference_s_acceleration_goes_ahead_by_newton_and_euler(law):
    spin, pull, turn = np.array([[0.3, -0.2, 0.4], [0.5, -0.6, 0.7], [1.0, 2.0, -1.5]])
    motion = np.concatenate([[0.1, 0.2, 0.3], spin, pull, turn])
    rotation = Rotation.from_quat(pose()[3:7]).as_matrix()
    inertia = rotation @ np.diag(list(INERTIA.values())) @ rotation.T
    at_com = pull + np.cross(turn, arm()) + np.cross(spin, np.cross(spin, arm()))
    force = MASS * (at_com - [0.0, 0.0, GRAVITY])
    moment = inertia @ turn + np.cross(spin, inertia @ spin) + np.cross(arm(), force)
    wrench = controller(law).step(pose(), reference(motion))
    np.testing.assert_allclose(wrench, [*force, *moment], rtol=1e-9)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("axis", range(6))
def test_each_coordinate_is_pushed_towards_its_reference(law, axis):
    found = controller(law)
    still = found.step(pose(), reference())
    wrench = found.step(pose(), reference(values=PLACE + 0.01 * np.eye(6)[axis])) - still
    # Proportional, and the derivative of a step through its filter.
    gains = LAWS[law][0]
    expected = 0.01 * (gains.kp + gains.ki * PERIOD + gains.kd * 200.0 / (1.0 + 200.0 * PERIOD))
    assert wrench[axis] == pytest.approx(expected)
    np.testing.assert_allclose(np.delete(wrench, axis), 0.0, atol=1e-9)


def test_pd_plus_answers_a_first_error_and_lqr_begins_gently():
    away = reference(values=PLACE + 0.01 * np.eye(6)[1])
    expected = {"pd_plus": 0.01 * LAWS["pd_plus"][0].kp, "lqr": 0.0}
    for law, force in expected.items():
        assert controller(law).step(pose(), away)[1] == pytest.approx(force, abs=1e-12)


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("scenario", "place", "angle"), [("rest", 0.3e-3, 0.6e-3), ("calm", 4e-3, 4e-3)]
)
def test_it_holds_the_bar(law, scenario, place, angle):
    """Within the noise at rest; in `calm` within what friction leaves PD+ without an integral."""
    given = cspm.load_scenario(scenario).with_parameter("control.motion", {"law": law})
    errors = cspm.simulate(given, duration=4).errors
    assert all(errors[dof]["max"] < place for dof in ("surge", "sway", "heave"))
    assert all(errors[dof]["max"] < angle for dof in ("pitch", "yaw"))


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS)
def test_with_the_sign_of_its_gains_inverted_it_loses_the_bar(law):
    scenario = cspm.load_scenario("rest").with_parameter("control.motion", {"law": law})
    wrong = {"kp": -200.0, "ki": 0.0, "kd": -50.0}
    gains = dict.fromkeys(("surge", "sway", "heave", "pitch", "yaw"), wrong)
    lost = scenario.with_parameter("control.motion.gains", gains)
    with pytest.warns(RuntimeWarning, match="infeasible since"):
        errors = cspm.simulate(lost, duration=1).errors
    assert errors["surge"]["max"] > 0.01
