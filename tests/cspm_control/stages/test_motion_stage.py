"""The motion controller while nobody follows its wrench, and when somebody does again."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_control.stages.make import make_controller
from cspm_control.stages.motion_stage import MotionStage
from cspm_model.motion import Motion
from cspm_msgs_py.schedule import BAR_POSE, BAR_REFERENCE, MOTION_CONTROLLER, WRENCH

WEIGHT = 4.06 * 9.81


@pytest.fixture(scope="module")
def bundle():
    return bundle_of("rest")


class Bench:
    """A motion stage and a bar that hangs a little below where it is wanted."""

    def __init__(self, bundle):
        self.stage = make_controller(MOTION_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
        self.reference = np.zeros(19)
        self.reference[2], self.reference[6] = 2.0, 1.0
        self.pose = self.reference[:7].copy()

    def step(self, heave):
        """Step with the bar at a heave error [m]; return the wrench."""
        self.pose[2] = self.reference[2] + heave
        sent = []
        rows = {BAR_POSE: self.pose, BAR_REFERENCE: self.reference}
        self.stage.step(0, rows, lambda topic, row: sent.append((topic, row)))
        ((topic, wrench),) = sent
        assert topic == WRENCH
        return wrench


def test_while_it_is_suspended_it_wants_no_more_than_to_carry_the_bar(bundle):
    bench = Bench(bundle)
    bench.step(0.0)
    bench.stage.suspend(True)
    for k in range(500):
        wrench = bench.step(0.04 * np.sin(0.1 * k))
        np.testing.assert_allclose(wrench, [0.0, 0.0, -WEIGHT, 0.0, 0.0, 0.0], atol=1e-9)


def test_it_goes_on_from_there_without_a_jump(bundle):
    bench = Bench(bundle)
    bench.stage.suspend(True)
    for _ in range(100):
        before = bench.step(0.005)
    bench.stage.suspend(False)
    after = bench.step(0.005)
    # The error counts from nothing on: after one step of 5 s it is next to nothing.
    assert abs(after[2] - before[2]) < 1e-3


def test_not_suspended_it_winds_up_all_it_may(bundle):
    bench = Bench(bundle)
    for _ in range(2000):
        wrench = bench.step(0.02)
    limit = bundle.scenario.control.motion.integral_limits[0]
    assert wrench[2] < -WEIGHT - limit


class Reported:
    """A controller that keeps by how much it is requested to deviate."""

    def step(self, bar_pose, frame_pose, reference, deviation):
        self.deviation = deviation
        return np.zeros(6)


def test_a_plan_begins_when_the_run_does():
    knots = np.zeros((3, 18))
    knots[:, 0], knots[:, 6] = [0.0, 0.1, 0.2], 0.1
    reported, rows = Reported(), {BAR_POSE: np.zeros(7), BAR_REFERENCE: np.zeros(19)}
    stage = MotionStage(reported, Motion(knots, 1.0))
    for start, now in ((0, 500_000_000), (7_000_000_000, 7_500_000_000)):
        stage.start(start)
        stage.step(now, rows, lambda _topic, _row: None)
        assert reported.deviation[0] == pytest.approx(0.05)
        assert reported.deviation[6] == pytest.approx(0.1)
