"""The cascade of controllers on a plant of one axis."""

import numpy as np
from scipy.linalg import expm

from cspm_model.equilibrium import gravity_wrench
from cspm_model.kinematics import geometry
from cspm_model.linearisation import linear_model, operating_point
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.scenario import MotionControl
from cspm_sim.parameters import plant_parameters

SCENARIO = MotionControl()
# Slower than the margins let it be [rad/s]: the table of the reconstruction.
CROSSOVER = {"surge": 12.0, "sway": 10.0, "heave": 12.0, "pitch": 12.0, "yaw": 10.0}
AXES = list(CONTROLLED_AXES)
CONTROLLED_DOFS = [DOFS[axis] for axis in AXES]
PERIOD = 1e-3


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
