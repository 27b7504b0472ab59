"""What plant and drives hand each other: in order, and neither while it is at work."""

import numpy as np

from cspm_msgs_py.stepping.drive_link import DriveLink

ROW = np.ones(2)


class Sides:
    """A plant that measures anew at each command, and a controller that answers the tension."""

    def __init__(self, steps):
        self.link, self.heard, self.step, self._steps = DriveLink("tension"), [], 0, steps
        self.depth = self.deepest = 0
        self.link.receive, self.link.command = self.receive, self.command
        self.link.tick = lambda: self.heard.append("tick")

    def measure(self):
        self.link.measure("tension", self.step, ROW)
        self.link.measure("winches", self.step, ROW)
        self.link.run()

    def receive(self, topic, stamp_ns, _):
        self.heard.append((topic, stamp_ns))
        if topic == "tension":
            self.link.order("torque", stamp_ns, ROW)
            self.link.run()

    def command(self, _, stamp_ns, __):
        self.depth += 1
        self.deepest = max(self.deepest, self.depth)
        self.heard.append(stamp_ns)
        self.step += 1
        if self.step < self._steps:
            self.measure()
        self.depth -= 1


def test_all_of_an_instant_comes_before_what_answers_it():
    sides = Sides(2)
    sides.measure()
    instants = [[("winches", k), ("tension", k), "tick", k] for k in range(2)]
    assert sides.heard == [each for instant in instants for each in instant]


def test_many_steps_are_no_deeper_than_one():
    sides = Sides(5000)
    sides.measure()
    assert sides.step == 5000
    assert sides.deepest == 1


def test_rows_may_change_after_they_were_handed_over():
    kept, row, link = [], np.zeros(2), DriveLink("tension")
    link.receive = lambda _topic, _stamp, given: kept.append(given)
    link.measure("tension", 0, row)
    row[:] = 1.0
    link.run()
    assert kept[0].tolist() == [0.0, 0.0]
