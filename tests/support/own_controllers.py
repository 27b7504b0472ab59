"""Scenarios that name controllers of the user's own, and their files."""

from run_samples import SCENARIOS

TENSION_PI = '''"""A PI controller of the cable tensions."""

import numpy as np


class TensionPi:
    def __init__(self, gain, more=0.0):
        self.gain = gain + more

    def start(self, period, testbed):
        self.period = period
        self.radius = np.array([c.drum_radius / c.gear_ratio for c in testbed.cables])
        self.integral = np.zeros(len(testbed.cables))

    def step(self, time, inputs):
        wanted, measured = inputs["/tension_command"], inputs["/cables/tension"]
        self.integral += self.period * (wanted - measured)
        return self.radius * (wanted + self.gain * (wanted - measured) + 2.0 * self.integral)
'''
LIFT = '''"""Forces on the bar that hold its weight and pull it to its reference, until it fails."""

import numpy as np


class Lift:
    def __init__(self, weight=0.0, fails_at=1e9):
        self.weight, self.fails_at = weight, fails_at

    def start(self, period, testbed):
        self.weight = testbed.bar.mass * testbed.gravity
        self.last = np.zeros(3)
        self.period = period

    def step(self, time, inputs):
        if time >= self.fails_at:
            raise ZeroDivisionError("nothing to divide by")
        error = inputs["/bar/reference"][:3] - inputs["/bar/pose"][:3]
        rate, self.last = (error - self.last) / self.period, error
        return [*(100.0 * error + 20.0 * rate - [0, 0, self.weight]), 0.0, 0.0, 0.0]
'''


def written(folder, controllers, scenario="rest", name="mine"):
    """Write controllers' files and a scenario that names them; return the scenario's path."""
    (folder / "tension_pi.py").write_text(TENSION_PI)
    (folder / "lift.py").write_text(LIFT)
    text = (SCENARIOS / f"{scenario}.yaml").read_text()
    text = text.replace("testbed: ", f"testbed: {SCENARIOS}/")
    path = folder / f"{name}.yaml"
    path.write_text(f"{text}\ncontrollers: {controllers}\n")
    return path


BOTH = (
    "{force_controller: {python: 'tension_pi.py:TensionPi', parameters: {gain: 0.5}},"
    " motion_controller: 'lift.py:Lift'}"
)
