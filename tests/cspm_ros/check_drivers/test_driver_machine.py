"""Weight and axes of machines of any geometry, against states of rest found on another road."""

from dataclasses import replace

import numpy as np
import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, Lab, said, steady_feed, wrong
from machines import build, rig_content
from scipy.spatial.transform import Rotation

from cspm_model.equilibrium import find_equilibrium
from cspm_model.kernels.rotation import quaternion_from_euler
from cspm_model.kinematics import rotation
from cspm_msgs_py.scenario import Rates
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_machine import turned
from cspm_sim.parameters import plant_parameters

FRAME_POSE = np.array([0.4, -0.2, 0.3, 0.002, -0.003, 0.6])


def pose_row(pose):
    row = np.empty(7)
    row[:3] = pose[:3]
    quaternion_from_euler(*pose[3:], row[3:])
    return row


def beneath(frame, offset):
    """A pose whose position is given in the frame's axes."""
    return np.concatenate([frame[:3] + rotation(frame) @ offset, [0.0, 0.0, frame[5]]])


@pytest.fixture
def hanging(request):
    """A machine at rest under a tilted frame, its tensions from the search for equilibria."""
    testbed = request.getfixturevalue(request.param)
    frame = FRAME_POSE if testbed.winch_frame else np.zeros(6)
    parameters = plant_parameters(testbed)
    limits = np.array([[0.0, 60.0]] * len(testbed.cables))
    bar = beneath(frame, [0.0, 0.0, 2.0])
    found = find_equilibrium(parameters, bar, frame, limits)
    feeds = {TENSION: steady_feed(testbed.topics[TENSION], 1000, 2.0)}
    rows = feeds[TENSION].rows - 5.0 + found.tensions
    feeds[TENSION] = replace(feeds[TENSION], rows=rows)
    for name, pose in ((BAR, found.bar_pose), (FRAME, frame)):
        if name in testbed.topics:
            feed = steady_feed(testbed.topics[name], 100, 2.0)
            noise = 5e-5 * (feed.rows - 5.0) / 0.02
            numbers = pose_row(pose) + np.where(np.arange(7) < 3, noise, 0.0)
            feeds[name] = replace(feed, rows=numbers)
    return Lab(testbed, Rates(), feeds)


MACHINES = pytest.mark.parametrize("hanging", ["general", "point", "thesis"], indirect=True)


def without_absence(findings):
    return {each for each in wrong(findings) if each[1] != "present"}


@MACHINES
def test_a_machine_at_rest_carries_its_weight(hanging):
    findings = hanging.findings()
    assert without_absence(findings) == set()
    assert said(findings, TENSION, "balance")[0][0] is True
    assert said(findings, BAR, "axes")[0][0] is True


@MACHINES
@pytest.mark.parametrize("factor", [1.3, 0.7, 2.0])
def test_a_wrong_gain_is_reported_with_its_size(hanging, factor):
    findings = hanging.but(TENSION, lambda feed: feed.scaled(factor)).findings()
    [(ok, text)] = said(findings, TENSION, "balance")
    assert ok is False
    assert float(text.rpartition("times ")[2]) == pytest.approx(factor, rel=0.02)


@pytest.mark.parametrize("hanging", ["general", "thesis"], indirect=True)
def test_axes_that_point_up_are_reported(hanging):
    flipped = hanging.but(BAR, lambda feed: feed.scaled(-1.0, [1, 2, 4, 5]))
    flipped = flipped.but(FRAME, lambda feed: feed.scaled(-1.0, [1, 2, 4, 5]))
    findings = flipped.findings()
    assert without_absence(findings) == {(BAR, "axes")}


@pytest.mark.parametrize("hanging", ["general"], indirect=True)
class TestWhatIsMissing:
    @pytest.mark.parametrize("name", [BAR, FRAME])
    def test_without_a_pose_nothing_is_said_of_the_geometry(self, hanging, name):
        findings = hanging.without(name).findings()
        assert said(findings, BAR, "axes") == [(None, f"cannot decide without a usable {name}")]
        assert said(findings, TENSION, "balance") == []

    def test_topics_of_different_times_are_not_compared(self, hanging):
        findings = hanging.but(FRAME, lambda feed: feed.shifted(10**10)).findings()
        assert said(findings, BAR, "axes") == [
            (
                None,
                f"cannot decide: the stamps of {BAR} and {FRAME} are not of the same time",
            )
        ]

    def test_without_poses_grams_are_still_reported(self, hanging):
        lab = hanging.without(BAR).but(TENSION, lambda feed: feed.scaled(101.97))
        [(ok, text)] = said(lab.findings(), TENSION, "units")
        assert ok is False
        assert text.startswith("looks in grams: ")

    def test_a_bar_in_the_exits_plane_cannot_decide_the_axes(self, hanging):
        exits = np.mean([cable.exit for cable in hanging.testbed.cables], axis=0)
        at_exits = pose_row(beneath(FRAME_POSE, exits))
        lab = hanging.but(BAR, lambda feed: replace(feed, rows=feed.rows * 0.0 + at_exits))
        lab = lab.but(BAR, lambda feed: replace(feed, rows=feed.rows + jitter(feed.rows)))
        assert said(lab.findings(), BAR, "axes") == [
            (None, "cannot decide: the bar is as high as the exits")
        ]

    def test_cables_that_carry_nothing_leave_it_open(self, hanging):
        findings = hanging.but(TENSION, lambda feed: feed.scaled(1e-3)).findings()
        [(ok, text)] = said(findings, TENSION, "balance")
        assert ok is None
        assert text.endswith(": does it hang?")

    def test_a_pose_at_which_a_cable_has_no_length_is_impossible(self, hanging):
        cable = hanging.testbed.cables[0]

        def placed(feed, position):
            rows = feed.rows.copy()
            rows[0, :3] = position
            return replace(feed, rows=rows)

        attitude = Rotation.from_quat(hanging.feeds[BAR].rows[0, 3:])
        exit_point = FRAME_POSE[:3] + rotation(FRAME_POSE) @ cable.exit
        lab = hanging.but(FRAME, lambda feed: placed(feed, FRAME_POSE[:3]))
        at_exit = exit_point - attitude.apply(cable.attachment)
        findings = lab.but(BAR, lambda feed: placed(feed, at_exit)).findings()
        assert said(findings, BAR, "axes") == [
            (False, "impossible pose: cable 0: length 0 m, its direction does not exist")
        ]

    def test_tensions_of_another_time_are_not_compared(self, hanging):
        findings = hanging.but(TENSION, lambda feed: feed.shifted(10**10)).findings()
        assert said(findings, TENSION, "geometry") == [
            (None, f"cannot decide: the stamps of {BAR} and {TENSION} are not of the same time")
        ]

    def test_a_few_poses_do_not_decide_the_balance(self, hanging):
        few = hanging.but(BAR, lambda feed: feed.only(slice(0, 200, 60)))
        assert said(few.findings(), TENSION, "balance") == [
            (None, "cannot decide from so few messages")
        ]

    def test_a_falling_bar_does_not_decide_the_balance(self, hanging):
        def falling(feed):
            rows = feed.rows.copy()
            times = (feed.stamps - feed.stamps[0]) * 1e-9
            rows[:, 2] += 0.5 * 9.0 * times**2
            return replace(feed, rows=rows)

        lab = hanging.but(BAR, lambda feed: falling(feed).only(slice(0, 60)))
        lab = lab.but(FRAME, lambda feed: feed.only(slice(0, 60)))
        [(ok, text)] = said(lab.findings(), TENSION, "balance")
        assert ok is None
        assert text.endswith(": it falls too fast to decide")

    def test_a_twist_without_pose_is_left_open(self, hanging):
        twist = steady_feed(hanging.testbed.topics["/bar/twist"], 100, 2.0)
        lab = replace(hanging.without(BAR), feeds={**hanging.feeds, "/bar/twist": twist})
        found = said(lab.without(BAR).findings(), "/bar/twist", "speed")
        assert found == [(None, f"cannot decide without a usable {BAR}")]


NEEDING = {
    "position": {"units", "speed", "length"},
    "velocity": {"speed"},
    "effort": {"torque", "holding"},
}


@pytest.mark.parametrize("hanging", ["general"], indirect=True)
@pytest.mark.parametrize("part", list(NEEDING))
def test_a_part_that_is_missing_leaves_open_what_needs_it(hanging, part):
    topic = hanging.testbed.topics[WINCHES]
    parts = tuple(each for each in topic.parts if each != part)
    fields = tuple(field for field in topic.fields if not field.startswith(part))
    partial = steady_feed(replace(topic, parts=parts, fields=fields), 1000, 2.0)
    findings = replace(hanging, feeds={**hanging.feeds, WINCHES: partial}).findings()
    checks = {finding.check for finding in findings if finding.topic == WINCHES}
    assert (WINCHES, "parts") in wrong(findings)
    assert not checks & NEEDING[part]
    assert checks >= set().union(*NEEDING.values()) - NEEDING[part]


@pytest.mark.parametrize("hanging", ["general"], indirect=True)
def test_load_cells_without_effort_leave_the_weight_open(hanging):
    names = hanging.testbed.cable_names
    fields = tuple(f"position/{name}" for name in names)
    lab = hanging.but(TENSION, lambda feed: feed.described(parts=("position",), fields=fields))
    findings = lab.findings()
    assert said(findings, TENSION, "parts") == [
        (False, "all messages: effort is empty, expected one number per name")
    ]
    assert said(findings, TENSION, "balance") == said(findings, TENSION, "units") == []


def jitter(rows):
    noise = np.random.default_rng(4).normal(0.0, 5e-5, rows.shape)
    noise[:, 3:] = 0.0
    return noise


def test_a_machine_without_bar_needs_no_poses(rig):
    findings = check_drivers(rig, Rates(), [])
    assert findings == []


def test_a_winch_without_cable_has_no_tension_to_hold():
    winch = {"name": "bare", "drum_radius": 0.025, "rotor_inertia": 1e-4, "torque_limit": 2.0}
    testbed = build({"name": "bench", "cables": [*rig_content()["cables"], winch]})
    topics = [testbed.topics[name] for name in (TENSION, WINCHES)]
    observations = [steady_feed(topic, 1000, 1.0).observation() for topic in topics]
    [(_, text)] = said(check_drivers(testbed, Rates(), observations), WINCHES, "holding")
    assert text.startswith("only: ")


def test_attitudes_are_integrated_in_world_axes():
    rng = np.random.default_rng(5)
    step = 1e-3
    omega = np.cumsum(rng.normal(0.0, 0.1, (1000, 3)), axis=0)
    attitude, quaternions = Rotation.from_rotvec([0.3, -0.4, 0.5]), []
    for rate in omega:
        quaternions.append(attitude.as_quat())
        attitude = Rotation.from_rotvec(step * rate) * attitude
    np.testing.assert_allclose(
        turned(np.array(quaternions))[1:], step * np.cumsum(omega[:-1], axis=0), atol=1e-12
    )
