"""Which goals a machine is taken to: hand-made passages, limits of the thesis's machine."""

import re

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_control.plausibility.goal_limits import GoalLimits, fastest_point
from cspm_control.waves.goal_trajectory import GoalTrajectory
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

REST = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
STILL = Motion.still(np.zeros(6))
MS = 1_000_000


@pytest.fixture(scope="module")
def bundle():
    return bundle_of("rest")


def limits_of(bundle, **safety):
    scenario = bundle.scenario
    changed = scenario.model_copy(update={"safety": scenario.safety.model_copy(update=safety)})
    return GoalLimits(changed, bundle.testbed.testbed, STILL)


def led(limits, goal, duration=10.0):
    """Ask for a goal from rest; return the trajectory."""
    trajectory = GoalTrajectory(Motion.still(REST), duration, limits.check)
    trajectory.step(0)
    trajectory.go(np.array(goal, dtype=float))
    return trajectory


def refused(limits, goal, duration=10.0):
    with pytest.raises(InputError) as caught:
        led(limits, goal, duration)
    return str(caught.value)


@pytest.mark.parametrize(
    "goal", [(0.08, 0.1, 2.1, 0.0, 0.01, 0.05), (0.0, 0.0, 2.6, 0.0, 0.0, 0.0)]
)
def test_a_goal_within_the_workspace_is_gone_to(bundle, goal):
    assert led(limits_of(bundle), goal).at_goal


def test_deep_below_the_bar_hangs_but_the_workspace_ends(bundle):
    said = refused(limits_of(bundle), (0.0, 0.0, 2000.0, 0.0, 0.0, 0.0), 1e6)
    assert said == "2e+03 m from the bar's mean position, allowed: at most 1 m (safety.workspace)"
    wide = limits_of(bundle, workspace=3000.0)
    assert led(wide, (0.0, 0.0, 2000.0, 0.0, 0.0, 0.0), 1e6).at_goal
    narrow = limits_of(bundle, workspace=0.1)
    assert led(narrow, (0.0, 0.0, 2.09, 0.0, 0.0, 0.0)).at_goal
    assert "allowed: at most 0.1 m" in refused(narrow, (0.0, 0.0, 2.11, 0.0, 0.0, 0.0))


def test_where_no_tensions_hold_the_bar_no_goal_is(bundle):
    said = refused(limits_of(bundle), (9.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    assert said.startswith("no tensions within the limits hold the bar at rest at [9, 0, 2, ")


def test_speed_and_acceleration_on_the_way_are_those_of_a_minimum_jerk_passage(bundle):
    """Their peaks are 15/8·d/T and 10/√3·d/T², Flash and Hogan (1985)."""
    goal, way, duration = (0.0, 0.0, 2.4, 0.0, 0.0, 0.0), 0.4, 2.0
    speed, acceleration = 15 / 8 * way / duration, 10 / np.sqrt(3) * way / duration**2
    for key, peak, unit in (("speed", speed, "m/s"), ("acceleration", acceleration, "m/s²")):
        fits = limits_of(bundle, **{f"pose_{key}": 1.02 * peak})
        assert led(fits, goal, duration).at_goal
        said = refused(limits_of(bundle, **{f"pose_{key}": 0.98 * peak}), goal, duration)
        found = re.match(rf"{key} of (\S+) {unit} on the way, allowed: at most ", said)
        assert float(found[1]) == pytest.approx(peak, rel=0.01)
        assert f"(safety.pose_{key})" in said


def test_a_way_for_which_tensions_do_not_suffice_is_refused(bundle):
    goal = (0.1, 0.0, 2.0, 0.0, 0.0, 0.0)
    assert led(limits_of(bundle), goal, 3.0).at_goal
    said = refused(limits_of(bundle, pose_acceleration=1e9, pose_speed=1e9), goal, 0.2)
    assert said.startswith("no tensions within the limits move the bar along the way, in surge ")
    assert said.endswith("allowed: a longer goal_duration, or another goal")


def test_points_off_the_middle_turn_with_the_body():
    """Turning about z at ω: a point at r moves at ω·r and accelerates by ω²·r."""
    row = np.zeros((1, 18))
    row[0, 11], row[0, 5] = 2.0, 0.7
    speed, acceleration = fastest_point(row, np.array([[0.0, 0.5, 0.0], [0.1, 0.0, 3.0]]))
    assert (speed, acceleration) == pytest.approx((1.0, 2.0))
    row[0, 17] = 3.0
    assert fastest_point(row, np.array([[0.0, 0.5, 0.0]]))[1] == pytest.approx(np.hypot(2.0, 1.5))


def test_jerk_is_bounded_by_the_passages_length_and_duration(bundle):
    trajectory = led(limits_of(bundle), (0.1, 0.0, 2.0, 0.0, 0.0, 0.0), 3.0)
    rows = []
    for i in range(3200):
        trajectory.step(i * MS)
        rows.append(trajectory.values.copy())
    jerk = np.diff(np.array(rows)[:, 12]) / 1e-3
    bound = 60 * 0.1 / 3.0**3
    assert 0.95 * bound < np.abs(jerk).max() <= 1.001 * bound
