"""A bar that is moved by hand, and switched to tracking."""

import numpy as np
import pytest

from cspm_control.waves.operation import operated
from cspm_model.motion import Motion
from cspm_msgs_py.scenario_keys.operation import Manual, Track

HOME = np.array([0.1, -0.2, 1.8, 0.0, 0.05, 0.1])
LOWERING = (0.0, 0.0, 0.05, 0.0, 0.0, 0.02)
HEAVE, YAW = 2, 5


def swell(amplitude=0.1, frequency=1.3):
    """Return a target that heaves, (see `Motion`), for 40 s."""
    spacing, direction = 0.02, np.eye(6)[HEAVE]
    phase = frequency * np.arange(2001) * spacing
    return Motion(
        np.hstack(
            [
                HOME + amplitude * np.outer(np.sin(phase), direction),
                amplitude * frequency * np.outer(np.cos(phase), direction),
                -amplitude * frequency**2 * np.outer(np.sin(phase), direction),
            ]
        ),
        spacing,
    )


def timetable(blend=5.0):
    return (
        Manual(at=4.0, blend=2.0, mode="manual", rate=LOWERING),
        Track(at=12.0, blend=blend, mode="track"),
    )


def sampled(motion, begin, end, period=1e-3):
    times = begin + period * np.arange(round((end - begin) / period))
    return np.array([motion.at(t) for t in times]).reshape(-1, 3, 6)


@pytest.fixture(scope="module")
def found():
    return operated(swell(), timetable(), 30.0)


def test_before_the_first_switch_and_after_the_last_it_tracks(found):
    for begin, end in ((0.0, 4.0), (17.0, 30.0)):
        np.testing.assert_allclose(
            sampled(found, begin, end)[:, 0], sampled(swell(), begin, end)[:, 0], atol=1e-9
        )


def test_by_hand_it_moves_at_its_rate_whatever_the_target_does(found):
    moving = sampled(found, 6.0, 12.0)
    np.testing.assert_allclose(moving[:, 1], np.tile(LOWERING, (6000, 1)), atol=1e-9)
    assert np.abs(moving[:, 2]).max() < 1e-6


def test_by_hand_it_starts_and_stops_without_turning_round():
    entries = (
        Manual(at=1.0, blend=2.0, mode="manual", rate=LOWERING),
        Manual(at=5.0, blend=2.0, mode="manual"),
    )
    found = sampled(operated(Motion.still(HOME), entries, 10.0), 0.0, 10.0)
    speed = found[:, 1, HEAVE]
    assert speed.min() >= -1e-12
    assert speed.max() <= 0.05 + 1e-12
    # A second is lost at the start, and caught up with at the stop.
    assert found[-1, 0, HEAVE] - HOME[HEAVE] == pytest.approx(0.05 * 4.0, abs=1e-9)


def test_velocity_and_acceleration_are_those_of_the_position(found):
    rows = sampled(found, 3.0, 20.0)
    for k in (0, 1):
        slope = (rows[2:, k] - rows[:-2, k]) / 2e-3
        np.testing.assert_allclose(slope, rows[1:-1, k + 1], atol=2e-4)


@pytest.mark.parametrize("at", [4.0, 6.0, 12.0, 17.0])
def test_nothing_jumps_at_a_switch_nor_at_its_end(found, at):
    before, after = (found.at(at + side * 1e-7) for side in (-1.0, 1.0))
    np.testing.assert_allclose(before, after, atol=1e-5)


def test_the_jerk_is_bounded_and_that_of_a_hard_switch_is_not():
    """At rest the profile's jerk is 60·d/T³ at most, d the way that is left."""
    still = Motion.still(HOME)
    entries = (
        Manual(at=1.0, blend=1.0, mode="manual", rate=(0.0, 0.0, -0.1, 0.0, 0.0, 0.0)),
        Manual(at=3.0, blend=1.0, mode="manual"),
    )

    def jerk(blend):
        track = Track(at=6.0, blend=blend, mode="track")
        motion = operated(still, (*entries, track), 20.0)
        away = HOME[HEAVE] - motion.at(6.0 if blend else 5.99)[HEAVE]
        change = np.diff(sampled(motion, 5.9, 14.0)[:, 2, HEAVE]) / 1e-3
        return np.abs(change).max(), 60.0 * away

    smooth, way = jerk(4.0)
    assert way > 0.0
    assert smooth <= 1.001 * way / 4.0**3
    assert jerk(0.0)[0] > 1000 * smooth


def test_a_switch_during_a_switch_starts_from_where_it_is():
    early = (*timetable(), Manual(at=13.0, blend=1.0, mode="manual"))
    found, without = operated(swell(), early, 30.0), operated(swell(), timetable(), 30.0)
    np.testing.assert_allclose(found.at(13.0), without.at(13.0), atol=1e-12)
    held = sampled(found, 14.0, 20.0)
    assert np.abs(held[:, 1]).max() < 1e-9


def test_it_turns_as_well(found):
    assert found.at(12.0)[YAW] - found.at(6.0)[YAW] == pytest.approx(0.02 * 6.0, abs=1e-9)
