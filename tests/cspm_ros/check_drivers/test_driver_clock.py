"""Times of reception are carried from the wall's clock to the one that `/clock` runs."""

import numpy as np
import pytest

from cspm_ros.check_drivers.driver_clock import on_ros_clock

TODAY_NS = 1_795_000_000_000_000_000


def received(walls):
    return [(int(wall), str(i).encode()) for i, wall in enumerate(walls)]


@pytest.mark.parametrize("speed", [0.25, 1.0, 3.0])
def test_a_clock_of_even_speed_is_followed_to_the_nanosecond(speed):
    rng = np.random.default_rng(1)
    walls = TODAY_NS + np.arange(0, 2_000_000_000, 100_000_000)
    ticks = [(int(wall), int((wall - TODAY_NS) * speed)) for wall in walls]
    samples = received(np.sort(rng.integers(walls[0], walls[-1], 200)))
    found = on_ros_clock(samples, ticks)
    assert [payload for _, payload in found] == [payload for _, payload in samples]
    for (time_ns, _), (wall, _) in zip(found, samples, strict=True):
        assert time_ns == pytest.approx((wall - TODAY_NS) * speed, abs=1.0)


def test_a_clock_that_stops_stamps_all_equally():
    found = on_ros_clock(received([TODAY_NS + 1, TODAY_NS + 5]), [(TODAY_NS, 7), (TODAY_NS + 9, 7)])
    assert [time_ns for time_ns, _ in found] == [7, 7]


def test_what_the_clock_does_not_cover_is_left_out():
    samples = received([TODAY_NS - 1, TODAY_NS, TODAY_NS + 10, TODAY_NS + 11])
    found = on_ros_clock(samples, [(TODAY_NS, 100), (TODAY_NS + 10, 120)])
    assert found == [(100, b"1"), (120, b"2")]


def test_a_time_of_today_keeps_its_nanoseconds():
    ticks = [(TODAY_NS, TODAY_NS + 3), (TODAY_NS + 1000, TODAY_NS + 1003)]
    assert on_ros_clock(received([TODAY_NS + 501]), ticks) == [(TODAY_NS + 504, b"0")]


def test_no_messages_stay_none():
    assert on_ros_clock([], [(0, 0), (1, 1)]) == []
