"""Replace the force controllers: a PI controller of the tensions with feedforward."""

import numpy as np

import cspm


class TensionPi:
    def start(self, period, testbed):
        self.period = period  # s
        self.radius = np.array([c.drum_radius / c.gear_ratio for c in testbed.cables])
        self.integral = np.zeros(len(testbed.cables))

    def step(self, time, inputs):
        wanted, measured = inputs["/tension_command"], inputs["/cables/tension"]
        self.integral += self.period * (wanted - measured)
        return self.radius * (wanted + 0.5 * (wanted - measured) + 2.0 * self.integral)  # N·m


own = cspm.simulate("calm", duration=5, controllers={"force_controller": TensionPi()})
usual = cspm.simulate("calm", duration=5)
for name, run in (("own", own), ("usual", usual)):
    print(f"{name}: heave error {run.errors['heave']['rms']:.2e} m RMS")
