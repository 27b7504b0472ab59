"""Replace the motion controller: a state-space model of python-control in every coordinate."""

import control
import numpy as np

import cspm


class StateSpace:
    def start(self, period, testbed):
        s, bar = control.tf("s"), testbed.bar
        pid = control.ss(150 + 150 / s + 25 * s / (1 + s / 200))  # acceleration per error
        self.law, self.gravity = pid.sample(period, "tustin"), testbed.gravity
        self.inertia = np.array([bar.mass] * 3 + [0.0, *np.diag(bar.inertia.matrix)[1:]])
        self.state = np.zeros((self.law.nstates, 6))

    def step(self, time, inputs):
        error = inputs["/bar/reference"][:6] - inputs["/bar/pose"][:6]
        wanted = (self.law.C @ self.state + self.law.D * error)[0] * [1, 1, 1, 2, 2, 2]
        self.state = self.law.A @ self.state + self.law.B * error  # m, and quaternions: rad/2
        return self.inertia * (wanted - self.gravity * np.eye(6)[2])  # N, N·m


run = cspm.simulate("calm", duration=5, controllers={"motion_controller": StateSpace()})
print(f"heave error {run.errors['heave']['rms']:.2e} m RMS")
