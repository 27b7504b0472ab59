"""Time that follows a clock which is corrected, and not one that is set."""

import pytest

from cspm_msgs_py.stepping.steady_time import STEP_NS, SteadyTime

NOW, MS = 1_800_000_000_000_000_000, 1_000_000


def looked(made, count, ros_of):
    """Look once a ms; return what was reported."""
    found = [made.look(ros_of(k), k * MS) for k in range(1, count + 1)]
    return [each for each in found if each is not None]


@pytest.mark.parametrize("rate", [1.0, 1.0 + 5e-4, 1.0 - 5e-4])
def test_a_clock_that_is_slewed_is_followed(rate):
    made = SteadyTime(NOW, 0)
    assert looked(made, 100_000, lambda k: NOW + round(k * MS * rate)) == []
    assert abs(made.now_ns(100_000 * MS) - NOW - 100_000 * MS * rate) < MS


@pytest.mark.parametrize(
    ("jump_ns", "reported"), [(STEP_NS + MS, 1), (-STEP_NS - MS, 1), (STEP_NS // 2, 0)]
)
def test_a_clock_that_is_set_is_reported_once_and_not_followed(jump_ns, reported):
    made = SteadyTime(NOW, 0)
    found = looked(made, 1000, lambda k: NOW + k * MS + jump_ns * (k > 500))
    assert len(found) == reported
    if reported:
        assert found[0] == (
            f"the ROS clock was set by {jump_ns * 1e-9:+.3f} s, allowed: corrections of up to"
            " 0.05 s"
        )
        assert abs(made.now_ns(1000 * MS) - NOW - 1000 * MS) < MS
        made.accept(NOW + 1000 * MS + jump_ns, 1000 * MS)
        assert made.now_ns(1000 * MS) == NOW + 1000 * MS + jump_ns


def test_a_clock_that_stands_still_is_reported_within_the_time_that_inputs_may_be_old():
    made = SteadyTime(NOW, 0)
    first = next(k for k in range(1, 1000) if made.look(NOW, k * MS) is not None)
    assert first * MS <= STEP_NS + 2 * MS
    assert made.now_ns(first * MS) > NOW + 0.99 * first * MS
