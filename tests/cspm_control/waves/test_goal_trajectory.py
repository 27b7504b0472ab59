"""A reference on its way to a goal and back: where it is, and that its derivatives are its own."""

import numpy as np
import pytest

from cspm_control.waves.goal_trajectory import GoalTrajectory
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

MS = 1_000_000
GOAL = np.array([0.1, -0.05, 2.2, 0.0, 0.02, 0.1])
DURATION = 2.0
SWAY = 1.3
"""Of the motion that is left [rad/s]."""


def waving():
    """A motion with its exact derivatives at knots 10 ms apart."""
    times = np.arange(0.0, 12.0, 0.01)
    knots = np.zeros((len(times), 18))
    knots[:, 2] = 2.0
    knots[:, 1] = 0.05 * np.sin(SWAY * times)
    knots[:, 7] = 0.05 * SWAY * np.cos(SWAY * times)
    knots[:, 13] = -0.05 * SWAY**2 * np.sin(SWAY * times)
    return Motion(knots, 0.01, False)


def followed(trajectory, begin, end):
    """Return pose and derivatives (n, 18) at steps of 1 ms."""
    found = []
    for i in range(begin, end):
        trajectory.step(i * MS)
        found.append(trajectory.values.copy())
    return np.array(found)


def any_way(*_):
    return None


@pytest.fixture
def trajectory():
    return GoalTrajectory(waving(), DURATION, any_way)


def test_without_a_goal_it_is_the_motion(trajectory):
    found = followed(trajectory, 0, 50)
    assert found == pytest.approx(np.array([trajectory.motion.at(i * 1e-3) for i in range(50)]))
    assert not trajectory.at_goal


def test_it_arrives_stays_and_comes_back(trajectory):
    followed(trajectory, 0, 1000)
    trajectory.go(GOAL)
    assert trajectory.at_goal
    followed(trajectory, 1000, 3001)
    assert trajectory.remaining == 0.0
    stays = followed(trajectory, 3001, 3500)
    assert (stays[:, :6] == GOAL).all()
    assert not stays[:, 6:].any()
    trajectory.go(None)
    followed(trajectory, 3500, 5501)
    back = followed(trajectory, 5501, 5600)
    motion = np.array([trajectory.motion.at(i * 1e-3) for i in range(5501, 5600)])
    assert back == pytest.approx(motion)
    assert not trajectory.at_goal


def test_velocity_and_acceleration_are_its_derivatives(trajectory):
    """Differences of what was sent are the independent road."""
    followed(trajectory, 0, 1000)
    trajectory.go(GOAL)
    found = followed(trajectory, 1000, 4000)
    speed = np.gradient(found[:, :6], 1e-3, axis=0)
    assert found[5:-5, 6:12] == pytest.approx(speed[5:-5], abs=1e-5)
    change = np.gradient(found[:, 6:12], 1e-3, axis=0)
    assert found[5:-5, 12:] == pytest.approx(change[5:-5], abs=1e-3)
    assert np.abs(np.diff(found[:, 12:], axis=0)).max() < 2e-3


def test_from_goal_to_goal_it_moves_in_a_line(trajectory):
    followed(trajectory, 0, 10)
    trajectory.go(GOAL)
    followed(trajectory, 10, 2100)
    other = GOAL + np.array([-0.2, 0.1, 0.0, 0.0, 0.0, -0.1])
    trajectory.go(other)
    found = followed(trajectory, 2100, 4200)
    along = (found[:, :6] - GOAL) @ (other - GOAL) / np.sum((other - GOAL) ** 2)
    assert found[:, :6] == pytest.approx(GOAL + np.outer(along, other - GOAL), abs=1e-12)
    assert (np.diff(along) >= 0.0).all()
    assert along[-1] == pytest.approx(1.0)


def test_a_goal_on_the_way_is_refused(trajectory):
    followed(trajectory, 0, 10)
    trajectory.go(GOAL)
    followed(trajectory, 10, 510)
    with pytest.raises(InputError) as caught:
        trajectory.go(GOAL)
    assert str(caught.value) == "on the way for 1.5 s more, allowed: a goal then"


def test_before_the_run_there_is_no_goal(trajectory):
    with pytest.raises(InputError) as caught:
        trajectory.go(GOAL)
    assert str(caught.value) == "the run has not begun, allowed: a goal while it is under way"


def test_a_way_that_the_machine_cannot_make_is_refused_and_nothing_moves():
    asked = []

    def check(times, rows):
        asked.append((times, rows))
        if rows[:, 2].max() > 2.14:
            raise InputError("too deep")

    trajectory = GoalTrajectory(waving(), DURATION, check)
    before = followed(trajectory, 0, 10)[-1]
    with pytest.raises(InputError, match=r"^too deep$"):
        trajectory.go(GOAL)
    assert len(asked) == 1
    assert followed(trajectory, 10, 11)[0] == pytest.approx(before, abs=1e-3)
    assert not trajectory.at_goal


@pytest.mark.parametrize("back", [False, True])
def test_what_is_checked_is_what_is_then_sent(back):
    asked = []
    trajectory = GoalTrajectory(waving(), DURATION, lambda *way: asked.append(way))
    followed(trajectory, 0, 1000)
    trajectory.go(GOAL)
    sent = followed(trajectory, 1000, 3100)
    if back:
        trajectory.go(None)
        sent = followed(trajectory, 3100, 5200)
    times, rows = asked[-1]
    begin = 3099 if back else 999
    assert times[0] == pytest.approx(begin * 1e-3)
    assert times[-1] - times[0] == pytest.approx(DURATION)
    # The passage begins with the next step, 1 ms later.
    steps = np.round((times - times[0]) * 1e3).astype(int)
    assert rows == pytest.approx(sent[steps], abs=2e-3)
    assert len(rows) > 20
