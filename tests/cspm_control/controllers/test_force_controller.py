import numpy as np
import pytest

from cspm_control.controllers.force_controller import ForceController
from cspm_msgs_py.control_spec.force import PiGains

RADII = np.array([0.0025, 0.025])
LIMITS = np.array([0.5, 2.0])
PERIOD = 1e-3
KP, OMEGA = np.array([0.01, 0.08]), np.array([40.0, 30.0])


def controller(limits=LIMITS, kp=KP, omega=OMEGA):
    gains = [PiGains(kp=k, integral_frequency=w) for k, w in zip(kp, omega, strict=True)]
    return ForceController(gains, RADII[: len(kp)], np.asarray(limits), period=PERIOD)


def test_the_first_torque_balances_the_measured_tension():
    found = controller()
    measured = np.array([30.0, 12.0])
    torque = found.step(np.array([35.0, 2.0]), measured)
    np.testing.assert_allclose(torque, RADII * measured, rtol=1e-12)
    assert found.saturated == 0


def test_pi_in_closed_form():
    found = controller()
    measured, wanted = np.array([10.0, 10.0]), np.array([10.5, 9.8])
    found.step(measured, measured)
    error = wanted - measured
    for k in range(100):
        torque = found.step(wanted, measured)
        expected = RADII * measured + KP * error * (1.0 + OMEGA * PERIOD * k)
        np.testing.assert_allclose(torque, expected, rtol=1e-10)


def test_the_torque_of_the_wanted_tension_goes_ahead():
    gains = [PiGains(kp=0.01, integral_frequency=0.0, feedforward=0.5)]
    found = ForceController(gains, RADII[:1], LIMITS[:1], period=PERIOD)
    at, more = np.array([10.0]), np.array([14.0])
    assert found.step(at, at)[0] == pytest.approx(RADII[0] * 10.0)
    expected = RADII[0] * 10.0 + 0.5 * RADII[0] * 4.0 + 0.01 * 4.0
    assert found.step(more, at)[0] == pytest.approx(expected)


def test_too_little_tension_winds_in():
    found = controller()
    at = np.array([10.0, 10.0])
    rest = found.step(at, at)
    torque = found.step(at, at - [1.0, -1.0])
    assert torque[0] > rest[0]
    assert torque[1] < rest[1]


def test_limits_hold_on_both_sides_and_are_counted():
    found = controller()
    at = np.array([10.0, 10.0])
    found.step(at, at)
    np.testing.assert_array_equal(found.step(at + 1000.0, at), LIMITS)
    assert found.saturated == 2
    np.testing.assert_array_equal(found.step(at - [1000.0, 0.0], at)[0], -LIMITS[0])
    assert found.saturated == 1
    found.step(at, at)
    assert found.saturated == 0


def test_at_the_limit_the_integrator_moves_only_back_into_range():
    found = controller(limits=[0.3], kp=[0.01], omega=[40.0])
    at = np.array([10.0])
    found.step(at, at)
    for _ in range(1000):
        found.step(at + 100.0, at)
    torque = found.step(at, at)
    # Held for a second the naive integral would be 0.025 + 40 N·m.
    assert torque[0] < 0.1
    integral = torque[0]
    for _ in range(20):
        assert found.step(at - 1.0, at)[0] < integral - 0.01 + 1e-12
    assert found.step(at, at)[0] == pytest.approx(integral - 20 * 0.01 * 40.0 * PERIOD)


def test_a_start_beyond_the_limit_comes_back_into_range():
    """What hangs on the cable needs 1 N·m, the limit is 0.5, and less tension is wanted."""
    found = ForceController(
        [PiGains(kp=0.01, integral_frequency=40.0)], RADII[1:], np.array([0.5]), period=PERIOD
    )
    steps = [found.step(np.array([10.0]), np.array([40.0]))[0] for _ in range(50)]
    unlimited = 1.0 - 0.01 * 40.0 * 30.0 * PERIOD * np.arange(50)
    np.testing.assert_allclose(steps, np.minimum(0.5, unlimited), atol=1e-12)
    assert unlimited[-1] < 0.5


class Naive:
    """The same PI with an integrator that does not know the limit."""

    def __init__(self, kp, omega, limit, start):
        self.kp, self.omega, self.limit, self.integral = kp, omega, limit, start

    def step(self, wanted, measured):
        error = wanted[0] - measured[0]
        torque = self.kp * error + self.integral
        self.integral += self.kp * self.omega * error * PERIOD
        return np.array([min(self.limit, max(-self.limit, torque))])


def response(law, radius=0.025, lag=0.02):
    """Tension of a lagging actuator: 1 s asked for more than the limit gives, then 1 s for less."""
    tension, found = 10.0, []
    for k in range(2000):
        wanted = 50.0 if k < 1000 else 12.0
        torque = law.step(np.array([wanted]), np.array([tension]))[0]
        tension += PERIOD / lag * (torque / radius - tension)
        found.append(tension)
    return np.array(found)


def test_recovery_from_the_limit_is_not_late_as_that_of_naive_integration():
    kp, omega, limit = 0.01, 40.0, 0.5
    gains = [PiGains(kp=kp, integral_frequency=omega)]
    ours = ForceController(gains, np.array([0.025]), np.array([limit]), period=PERIOD)
    found = response(ours)
    naive = response(Naive(kp, omega, limit, 0.025 * 10.0 - kp * 40.0))
    assert found[999] == pytest.approx(20.0, abs=0.01)  # as much as the limit gives
    settled = [np.flatnonzero(np.abs(t[1000:] - 12.0) > 0.1)[-1] * PERIOD for t in (found, naive)]
    assert settled[0] < 0.3
    assert settled[1] > 0.9
    astray = [np.abs(t[1000:] - 12.0).mean() for t in (found, naive)]
    assert astray[0] < 0.1 * astray[1]


def test_cables_do_not_see_each_other():
    found, alone = controller(), controller(limits=LIMITS[:1], kp=KP[:1], omega=OMEGA[:1])
    rng = np.random.default_rng(3)
    for _ in range(50):
        wanted, measured = rng.uniform(2.0, 60.0, (2, 2))
        both = found.step(wanted, measured)
        assert both[0] == alone.step(wanted[:1], measured[:1])[0]
