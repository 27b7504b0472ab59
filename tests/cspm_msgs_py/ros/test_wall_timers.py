"""Timers of a loop that looks at the clock itself: when they are due, and what lateness costs."""

import math

import pytest

from cspm_msgs_py.ros.wall_timers import WallTimers

MS = 1_000_000


class Clock:
    """A clock that a test sets [ns]."""

    def __init__(self):
        self.ns = 5_000 * MS

    def __call__(self):
        return self.ns

    def pass_ms(self, ms):
        self.ns += round(ms * MS)


@pytest.fixture
def clock():
    return Clock()


def test_a_timer_is_called_an_interval_after_it_was_made_and_again(clock):
    timers, calls = WallTimers(clock), []
    timers.add(0.002, lambda: calls.append(clock.ns))
    assert timers.run() == pytest.approx(0.002)
    clock.pass_ms(1.9)
    assert timers.run() == pytest.approx(0.0001)
    assert calls == []
    for _ in range(3):
        clock.pass_ms(2.0)
        timers.run()
    assert len(calls) == 3
    # Not 2 ms from the call that was late: 2 ms from when that one was due.
    assert timers.run() == pytest.approx(0.0001)


def test_who_is_late_skips_what_was_due_meanwhile_and_keeps_the_beat(clock):
    timers, calls = WallTimers(clock), []
    timers.add(0.001, lambda: calls.append(clock.ns))
    clock.pass_ms(7.25)
    assert timers.run() == pytest.approx(0.00075)
    assert len(calls) == 1
    clock.pass_ms(0.75)
    timers.run()
    assert len(calls) == 2


def test_timers_are_called_in_the_order_in_which_they_are_due(clock):
    timers, calls = WallTimers(clock), []
    timers.add(0.003, lambda: calls.append("slow"))
    timers.add(0.001, lambda: calls.append("quick"))
    timers.add(0.001, lambda: calls.append("as quick"))
    clock.pass_ms(3.5)
    timers.run()
    assert calls == ["quick", "as quick", "slow"]


def test_a_cancelled_timer_is_not_called_even_by_one_that_is_due_with_it(clock):
    timers, calls = WallTimers(clock), []
    timers.add(0.001, lambda: later.cancel())
    later = timers.add(0.001, lambda: calls.append("later"))
    clock.pass_ms(1.0)
    timers.run()
    clock.pass_ms(5.0)
    timers.run()
    assert calls == []


def test_a_timer_may_be_made_by_another(clock):
    timers, calls = WallTimers(clock), []
    first = timers.add(0.001, lambda: timers.add(0.002, lambda: calls.append(clock.ns)))
    clock.pass_ms(1.0)
    timers.run()
    first.cancel()
    clock.pass_ms(2.0)
    timers.run()
    assert len(calls) == 1


def test_where_there_is_nothing_to_do_there_is_time_for_ever(clock):
    timers = WallTimers(clock)
    assert timers.run() == math.inf
    timers.add(0.001, lambda: None).cancel()
    clock.pass_ms(1.0)
    assert timers.run() == math.inf
