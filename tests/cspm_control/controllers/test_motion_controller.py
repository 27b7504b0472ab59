from math import pi

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cspm_control.controllers.motion_controller import MotionController
from cspm_model.kernels.rows import pose_row
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario import PidGains
from cspm_msgs_py.testbed import Bar

GRAVITY = 9.81
MASS = 4.0
PERIOD = 0.01
POLE = 200.0
CONTROLLED = ("surge", "sway", "heave", "pitch", "yaw")
GAINS = {
    name: PidGains(kp=100.0 + i, ki=50.0 + i, kd=20.0 + i) for i, name in enumerate(CONTROLLED)
}
HOME = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
WEIGHT = np.array([0.0, 0.0, -MASS * GRAVITY, 0.0, 0.0, 0.0])


def bar(com=(0.0, 0.0, 0.0)):
    inertia = {"ixx": 0.1, "iyy": 0.3, "izz": 0.3}
    return Bar(mass=MASS, inertia=inertia, com=com, dimensions=(1.0, 0.1, 0.1))


def controller(gains=GAINS, com=(0.0, 0.0, 0.0), limits=(20.0, 5.0), period=PERIOD, pole=POLE):
    return MotionController(
        gains,
        bar(com),
        GRAVITY,
        period=period,
        derivative_filter=pole,
        integral_limits=limits,
    )


def pose(values=HOME):
    row = np.empty(7)
    pose_row(np.asarray(values, dtype=float), row)
    return row


def reference(values=HOME):
    return np.concatenate([pose(values), np.zeros(12)])


def away(dof, by):
    values = HOME.copy()
    values[dof] += by
    return values


def only(dof, **gains):
    return {dof: PidGains(**{"kp": 0.0, "ki": 0.0, "kd": 0.0, **gains})}


def test_at_the_reference_the_wrench_holds_the_weight_upwards():
    found = controller()
    for _ in range(5):
        np.testing.assert_allclose(found.step(pose(), reference()), WEIGHT, atol=1e-12)


@pytest.mark.parametrize("dof", [0, 1, 2, 4, 5])
def test_each_dof_is_pushed_towards_its_reference(dof):
    found = controller()
    found.step(pose(), reference())
    wrench = found.step(pose(), reference(away(dof, 0.01))) - WEIGHT
    assert wrench[dof] > 0.5
    np.testing.assert_allclose(np.delete(wrench, dof), 0.0, atol=1e-9)
    # The measured pose counts the other way.
    found = controller()
    found.step(pose(), reference())
    assert found.step(pose(away(dof, 0.01)), reference())[dof] - WEIGHT[dof] < -0.5


def test_roll_gets_nothing():
    found = controller()
    found.step(pose(), reference())
    for error in (0.3, -0.3, 0.5):
        wrench = found.step(pose(away(3, error)), reference(away(3, -error)))
        np.testing.assert_allclose(wrench, WEIGHT, atol=1e-9)


def test_the_first_output_is_the_weight_whatever_the_error():
    start = np.array([0.01, -0.02, 2.03, 0.2, -0.04, 0.03])
    found = controller()
    np.testing.assert_allclose(found.step(pose(start), reference()), WEIGHT, atol=1e-12)
    # And it stays there: without integral action nothing changes while the error stays.
    gains = {name: PidGains(kp=100.0, ki=0.0, kd=20.0) for name in CONTROLLED}
    found = controller(gains)
    for _ in range(3):
        np.testing.assert_allclose(found.step(pose(start), reference()), WEIGHT, atol=1e-9)


def test_a_start_too_far_away_is_cancelled_up_to_the_limit():
    found = controller(only("surge", kp=100.0), limits=(20.0, 5.0))
    wrench = found.step(pose(), reference(away(0, 0.5)))
    assert wrench[0] == pytest.approx(100.0 * 0.5 - 20.0)


def test_proportional_and_integral_terms_in_closed_form():
    kp, ki, error = 100.0, 50.0, 0.02
    found = controller(only("sway", kp=kp, ki=ki))
    found.step(pose(), reference())
    for k in range(1, 50):
        force = found.step(pose(), reference(away(1, error)))[1]
        assert force == pytest.approx(kp * error + ki * error * k * PERIOD, rel=1e-12)


def test_derivative_of_a_ramp_is_its_filtered_slope():
    """Backward Euler of s·p/(s + p) on a ramp: slope·(1 − (1 + p·T)^−k)."""
    slope, kd = 0.3, 20.0
    found = controller(only("surge", kd=kd))
    for k in range(40):
        force = found.step(pose(), reference(away(0, slope * k * PERIOD)))[0]
        expected = kd * slope * (1.0 - (1.0 + POLE * PERIOD) ** -k)
        assert force == pytest.approx(expected, abs=1e-12)


def test_derivative_tends_to_the_continuous_filter():
    period, pole, omega = 1e-4, 200.0, 15.0
    found = controller(only("surge", kd=1.0), period=period, pole=pole)
    time = np.arange(20_000) * period
    errors = 0.1 * np.sin(omega * time)
    forces = [found.step(pose(), reference(away(0, error)))[0] for error in errors]
    response = 1j * omega * pole / (1j * omega + pole)
    steady = time > 0.1
    expected = 0.1 * np.imag(response * np.exp(1j * omega * time))
    np.testing.assert_allclose(np.array(forces)[steady], expected[steady], atol=0.01 * 0.1 * omega)


@pytest.mark.parametrize(("dof", "limit"), [("heave", 20.0), ("yaw", 5.0)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_integral_stops_at_its_limit_and_leaves_it_at_once(dof, limit, side):
    axis = DOFS.index(dof)
    found = controller(only(dof, ki=1000.0))
    found.step(pose(), reference())
    far = reference(away(axis, side * 0.1))
    for _ in range(100):
        force = found.step(pose(), far)[axis] - WEIGHT[axis]
    assert force == pytest.approx(side * limit)
    # However long it stood there, the first error of the other sign takes it back.
    force = found.step(pose(), reference(away(axis, -side * 0.01)))[axis] - WEIGHT[axis]
    assert force == pytest.approx(side * (limit - 1000.0 * 0.01 * PERIOD))


@pytest.mark.parametrize("com", [(0.1, 0.0, 0.0), (0.0, 0.05, 0.02), (0.03, -0.02, 0.05)])
def test_centre_of_mass_beside_the_origin_needs_a_moment(com):
    found = controller(com=com)
    for angles in ((0.0, 0.0, 0.0), (0.2, -0.3, 0.9)):
        values = np.concatenate([HOME[:3], angles])
        wrench = found.step(pose(values), reference(values))
        arm = Rotation.from_euler("ZYX", angles[::-1]).apply(com)
        np.testing.assert_allclose(wrench[:3], WEIGHT[:3], atol=1e-12)
        np.testing.assert_allclose(wrench[3:], np.cross(arm, WEIGHT[:3]), atol=1e-12)


def test_mass_ahead_of_the_origin_is_lifted_by_the_bow():
    """Weight at +x pitches the bow down, so the wrench must raise it: a positive moment about y."""
    assert controller(com=(0.1, 0.0, 0.0)).step(pose(), reference())[4] > 0.0


@pytest.mark.parametrize("dof", [0, 2, 4, 5])
def test_a_constant_load_leaves_no_error(dof):
    """A free body of unit inertia under a load that the controller does not know."""
    crossover, step = 8.0, 1e-3
    gains = PidGains(kp=crossover**2, ki=crossover**3 / 10, kd=2 * crossover)
    found = controller({DOFS[dof]: gains}, period=step, limits=(1000.0, 1000.0))
    place, speed, load, furthest = 0.0, 0.0, 5.0, 0.0
    for _ in range(20_000):
        wrench = found.step(pose(away(dof, place)), reference()) - WEIGHT
        speed += step * (wrench[dof] + load)
        place += step * speed
        furthest = max(furthest, abs(place))
    assert furthest > 0.02
    assert abs(place) < 1e-6
    assert abs(speed) < 1e-6


def test_an_error_across_half_a_turn_is_the_short_one():
    values, wanted = HOME.copy(), HOME.copy()
    values[5], wanted[5] = -pi + 0.01, pi - 0.01
    found = controller(only("yaw", kp=100.0))
    found.step(pose(values), reference(values))
    wrench = found.step(pose(values), reference(wanted))
    assert wrench[5] == pytest.approx(-100.0 * 0.02, abs=1e-9)


def test_angles_are_euler_angles_not_the_rotation_vector():
    values = np.array([0.0, 0.0, 2.0, 0.0, 0.3, 0.8])
    found = controller({"pitch": PidGains(kp=100, ki=0, kd=0), "yaw": PidGains(kp=10, ki=0, kd=0)})
    found.step(pose(), reference())
    wrench = found.step(pose(), reference(values)) - WEIGHT
    np.testing.assert_allclose(wrench, [0, 0, 0, 0, 30.0, 8.0], atol=1e-12)


def test_after_a_restart_the_bar_is_led_to_its_reference():
    """By minimum jerk, however far away it is: half of the error counts after half of the time."""
    found = controller(only("heave", kp=1000.0))
    found.restart()
    far = reference(away(2, 0.4))
    wrenches = [found.step(pose(), far)[2] - WEIGHT[2] for _ in range(round(5.0 / PERIOD) + 2)]
    assert wrenches[0] == 0.0
    assert wrenches[round(2.5 / PERIOD)] == pytest.approx(200.0)
    assert wrenches[-1] == pytest.approx(400.0)
    assert np.diff(wrenches).max() < 1.9 * 400.0 * PERIOD / 5.0
