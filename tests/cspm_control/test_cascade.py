"""The closed cascade on the linear model: stable, continuous and sampled, but for the roll."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from cspm_control.design.gains import CONTROLLED_DOFS, design_force_gains, design_motion_gains
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kinematics import geometry
from cspm_model.linearisation import linear_model, operating_point
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.scenario import ForceControl, MotionControl, PidGains, PiGains
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.parameters import plant_parameters

TESTBEDS = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds"
THESIS = load_testbed(TESTBEDS / "thesis.yaml").testbed.model_copy(update={"effects": ()})
PARAMETERS = plant_parameters(THESIS)
SCENARIO = MotionControl()
CENTRE = SCENARIO.design_pose
AXES = list(CONTROLLED_AXES)
PERIOD = 1e-3


@pytest.fixture(scope="module")
def motion_gains():
    return design_motion_gains(THESIS, PARAMETERS, CENTRE, SCENARIO.crossover)


@pytest.fixture(scope="module")
def force_gains():
    return design_force_gains(THESIS, PARAMETERS, CENTRE, ForceControl().bandwidth)


class Cascade:
    """The closed loop of linear plant and controllers, as linear maps of one state vector.

    State: plant, integral terms, derivative terms, last errors (sampled only), force integrals.
    """

    def __init__(self, testbed, pose, motion, force, *, exact) -> None:
        parameters = plant_parameters(testbed)
        self.point = operating_point(testbed, parameters, pose)
        self.plant = linear_model(testbed, parameters, self.point, exact=exact)
        self.n = len(self.plant.inputs)
        self.pid = np.array([(motion[d].kp, motion[d].ki, motion[d].kd) for d in CONTROLLED_DOFS]).T
        self.kp = np.array([force[name].kp for name in testbed.cable_names])
        self.integral = np.array([force[name].integral_frequency for name in testbed.cable_names])
        self.distribute = -np.linalg.pinv(self.point.jacobian[:, AXES].T)
        # In truth the distribution sees the measured pose, which moves the weight's tensions.
        self.weight_shift = self._weight_shift(parameters) if exact else np.zeros((self.n, 6))

    def _weight_shift(self, parameters):
        wrench = -gravity_wrench(parameters, self.point.bar_pose)[AXES]

        def tensions(pose):
            jacobian = geometry(parameters.cables, pose, self.point.frame_pose).bar
            return -np.linalg.pinv(jacobian[:, AXES].T) @ wrench

        pose, step = self.point.bar_pose, 1e-6
        columns = [tensions(pose + step * e) - tensions(pose - step * e) for e in np.eye(6)]
        return np.array(columns).T / (2 * step)

    def tension_command(self, x, wrench):
        return self.distribute @ wrench + self.weight_shift @ x[:6]

    def continuous(self):
        size, pole = len(self.plant.A), SCENARIO.derivative_filter
        kp, ki, kd = self.pid

        def rate(state):
            x, term, slow, force = np.split(state, [size, size + 5, size + 10])
            error = -x[AXES]
            wrench = kp * error + term + kd * pole * (error - slow)
            missing = self.tension_command(x, wrench) - self.plant.C[12:] @ x
            torque = self.kp * missing + force
            return np.concatenate(
                [
                    self.plant.A @ x + self.plant.B @ torque,
                    ki * error,
                    pole * (error - slow),
                    self.kp * self.integral * missing,
                ]
            )

        return np.array([rate(e) for e in np.eye(size + 10 + self.n)]).T

    def sampled(self, every):
        """One period of the motion controller, `every` periods of the force controllers."""
        size, pole, period = len(self.plant.A), SCENARIO.derivative_filter, every * PERIOD
        kp, ki, kd = self.pid
        hold = np.zeros((size + self.n, size + self.n))
        hold[:size] = np.hstack([self.plant.A, self.plant.B])
        a, b = np.split(expm(PERIOD * hold)[:size], [size], axis=1)

        def advance(state):
            x, term, slope, last, force = np.split(state, [size, size + 5, size + 10, size + 15])
            error = -x[AXES]
            term = term + ki * error * period
            slope = (slope + pole * (error - last)) / (1.0 + pole * period)
            command = self.tension_command(x, kp * error + term + kd * slope)
            for _ in range(every):
                missing = command - self.plant.C[12:] @ x
                torque = self.kp * missing + force
                force = force + self.kp * self.integral * missing * PERIOD
                x = a @ x + b @ torque
            return np.concatenate([x, term, slope, error, force])

        monodromy = np.array([advance(e) for e in np.eye(size + 15 + self.n)]).T
        values = np.linalg.eigvals(monodromy)
        return np.log(values[np.abs(values) > 1e-9].astype(complex)) / period


def split_roll(poles):
    """Return the two poles of the uncontrolled roll, slow or near 27 rad/s, and all others."""
    rolls = (np.abs(poles) < 0.01) | ((np.abs(poles.imag) > 20.0) & (poles.real > -0.1))
    return poles[rolls], poles[~rolls]


@pytest.mark.parametrize("height", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("exact", [False, True])
def test_closed_cascade_is_stable_but_for_roll(exact, height, motion_gains, force_gains):
    pose = (0.0, 0.0, height, 0.0, 0.0, 0.0)
    cascade = Cascade(THESIS, pose, motion_gains, force_gains, exact=exact)
    loops = {
        "continuous": np.linalg.eigvals(cascade.continuous()),
        "1000 Hz": cascade.sampled(1),
        "100 Hz": cascade.sampled(10),
    }
    for name, poles in loops.items():
        rolls, others = split_roll(poles)
        assert len(rolls) == 2, name
        # The slowest are the integral actions at a fortieth of the crossover frequency.
        assert others.real.max() == pytest.approx(-0.249, abs=0.001), name
        damping = -others.real / np.abs(others)
        assert damping.min() > (0.6 if name == "100 Hz" else 0.45), name
        if exact:
            assert np.abs(rolls).max() == pytest.approx(26.7, abs=0.1), name


def test_roll_creeps_up_where_the_motion_loop_is_fast(motion_gains, force_gains):
    """No controller sees roll; how the tensions follow the measured pose moves it a little."""
    cascade = Cascade(THESIS, CENTRE, motion_gains, force_gains, exact=True)
    growth = [split_roll(cascade.sampled(every))[0].real.max() for every in (1, 10)]
    np.testing.assert_allclose(growth, [0.0059, -0.0090], atol=2e-4)


def test_inverted_gains_are_unstable(motion_gains, force_gains):
    inverted = {
        dof: PidGains(kp=-g.kp, ki=-g.ki, kd=-g.kd) if dof == "surge" else g
        for dof, g in motion_gains.items()
    }
    backward = {
        name: PiGains(kp=-g.kp, integral_frequency=g.integral_frequency)
        for name, g in force_gains.items()
    }
    for motion, force in ((inverted, force_gains), (motion_gains, backward)):
        cascade = Cascade(THESIS, CENTRE, motion, force, exact=False)
        assert np.linalg.eigvals(cascade.continuous()).real.max() > 1.0
