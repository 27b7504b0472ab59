"""Curves and waypoints: where they go, that they begin at rest, and that rates are derivatives."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter

from cspm_control.waves.build import build_motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import MotionSpec
from cspm_msgs_py.scenario import parse_scenario

MEAN = (0.1, -0.2, 2.0, 0.0, 0.0, 0.3)
FAST = {"acceleration": 0.5, "jerk": 4.0}
KINDS = {
    "line": {"type": "line", "period": 4.0, "to": [0.3, 0, 0, 0, 0, 0.1]},
    "circle": {"type": "circle", "period": 3.0, "radius": 0.3},
    "lemniscate": {"type": "lemniscate", "period": 5.0, "size": [0.4, 0.2]},
    "helix": {"type": "helix", "period": 2.0, "radius": 0.2, "rise": 0.3, "turns": 2},
    "sines": {"type": "sines", "sines": {"heave": [{"amplitude": 0.1, "frequency": 0.5}]}},
    "quintic": {"type": "waypoints", "points": [{"to": [0.3, 0, 0, 0, 0, 0], "duration": 2.0}]},
    "limited": {
        "type": "waypoints",
        "profile": "jerk_limited",
        **FAST,
        "points": [{"to": [0.3, 0.4, 0, 0, 0, 0], "speed": 0.2, "pause": 0.5}],
    },
}


def motion(kind, **changes):
    spec = TypeAdapter(MotionSpec).validate_python(KINDS[kind] | changes)
    return build_motion(spec, MEAN, seed=1, duration=12.0, gravity=9.81, folder=Path())


def displacements(found, times):
    return np.array([found.at(t)[:6] for t in times]) - MEAN


@pytest.mark.parametrize("kind", KINDS)
def test_rates_are_derivatives_and_the_beginning_is_at_rest(kind):
    found, step = motion(kind), 1e-4
    for time in (0.7, 2.3, 5.1):
        ahead, behind = found.at(time + step), found.at(time - step)
        slopes = (ahead - behind)[:12] / (2 * step)
        np.testing.assert_allclose(slopes, found.at(time)[6:], atol=2e-3)
    np.testing.assert_allclose(found.at(0.0)[6:12], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.at(0.0)[:6], MEAN, atol=1e-9)


def test_a_circle_keeps_its_radius_and_runs_from_surge_towards_sway():
    found = displacements(motion("circle"), [3.0, 3.75, 4.5])
    np.testing.assert_allclose(found[0, :2], [0.3, 0.0], atol=1e-6)
    np.testing.assert_allclose(found[1, :2], [0.0, 0.3], atol=1e-6)
    np.testing.assert_allclose(found[:, 2:], 0.0, atol=1e-9)


def test_a_turned_circle_lies_in_another_plane():
    found = displacements(motion("circle", turn=[np.pi / 2, 0.0, 0.0]), [3.75])[0]
    np.testing.assert_allclose(found[:3], [0.0, 0.0, 0.3], atol=1e-6)


def test_the_line_reaches_its_far_end_and_the_helix_rises():
    np.testing.assert_allclose(displacements(motion("line"), [6.0])[0], [0.3, 0, 0, 0, 0, 0.1])
    # Up is against heave; two turns up, two down.
    assert displacements(motion("helix"), [4.0])[0, 2] == pytest.approx(-0.3)
    assert displacements(motion("helix"), [8.0])[0, 2] == pytest.approx(0.0, abs=1e-9)


def test_the_lemniscate_crosses_its_middle():
    found = displacements(motion("lemniscate"), [5.0, 6.25, 7.5])
    np.testing.assert_allclose(found[[0, 2], :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(found[1, :2], [0.4, 0.0], atol=1e-6)


def test_a_jerk_limited_way_keeps_its_limits_and_arrives():
    found = motion("limited")
    times = np.arange(0.0, 6.0, 0.005)
    rows = np.array([found.at(t) for t in times])
    speed = np.linalg.norm(rows[:, 6:8], axis=1)
    bend = np.linalg.norm(rows[:, 12:14], axis=1)
    assert speed.max() == pytest.approx(0.2, rel=1e-3)
    assert bend.max() == pytest.approx(0.5, rel=1e-2)
    assert np.abs(np.diff(bend)).max() / 0.005 <= 4.0 * 1.01
    np.testing.assert_allclose(rows[-1, :2] - MEAN[:2], [0.3, 0.4], atol=1e-6)
    # Length over speed, and once the time within which the speed rises.
    rise = 0.2 / 0.5 + 0.5 / 4.0
    arrived = times[np.argmax(np.linalg.norm(rows[:, :2] - MEAN[:2], axis=1) > 0.5 - 1e-7)]
    assert arrived == pytest.approx(0.5 / 0.2 + rise, abs=0.03)


def test_a_short_jerk_limited_way_never_reaches_its_speed():
    short = [{"to": [0.01, 0, 0, 0, 0, 0], "speed": 0.2}]
    found = motion("limited", points=short)
    peak = max(found.at(t)[6] for t in np.arange(0.0, 2.0, 0.005))
    assert 0.01 < peak < 0.1
    np.testing.assert_allclose(displacements(found, [3.0])[0, 0], 0.01, atol=1e-7)


@pytest.mark.parametrize(
    ("motion", "text"),
    [
        ("{type: waypoints, points: [{to: [0, 0, 0, 0, 0, 0]}]}", "speed, duration: both or nei"),
        (
            "{type: waypoints, profile: jerk_limited, points: [{to: [0,0,0,0,0,0], duration: 1}]}",
            "duration: with profile jerk_limited, allowed: a speed",
        ),
        ("{type: circle, period: 3, radius: -1}", "radius: -1, allowed: greater than 0"),
    ],
)
def test_each_fault_is_one_line(motion, text):
    content = f"{{name: a, testbed: b.yaml, duration: 1, target: {{motion: {motion}}}}}"
    with pytest.raises(InputError) as caught:
        parse_scenario(content, "own.yaml")
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)
