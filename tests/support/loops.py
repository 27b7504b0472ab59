"""What may be given to a closed loop: a machine that runs away, something that listens."""

from pathlib import Path

import numpy as np

from cspm_run.assembly import assemble
from cspm_run.loop import Loop

WILD = (
    "control={mode: closed_loop, motion: {gains: {surge: {kp: -90000, ki: 0, kd: 0}}},"
    " tension_distribution: {method: pseudo_inverse}}",
    "rates.motion_controller=1000",
    "rates.motion_capture=1000",
)


class Listener:
    """Keeps what a loop sends: log times, stamps and rows by topic, and the statuses."""

    def __init__(self, bundle, sensors=None):
        testbed = bundle.testbed.testbed
        testbed = testbed.model_copy(update={"sensors": testbed.sensors | (sensors or {})})
        self.parts = assemble(bundle.scenario, testbed, Path())
        self.messages = {name: [] for name in testbed.topics}
        self.statuses = []
        publish = {name: self.listen(name) for name in testbed.topics}
        self.loop = Loop(self.parts, publish, lambda now, found: self.statuses.append((now, found)))

    def statuses_of(self, node):
        return [(now, status) for now, status in self.statuses if status.name == node]

    def listen(self, name):
        return lambda log, stamp, row: self.messages[name].append((log, stamp, row.copy()))

    def run(self, steps):
        for _ in range(steps):
            self.loop.step()
        return self

    def log(self, name):
        return np.array([log for log, _, _ in self.messages[name]])

    def stamp(self, name):
        return np.array([stamp for _, stamp, _ in self.messages[name]])

    def rows(self, name):
        return np.array([row for _, _, row in self.messages[name]])
