"""What discovery announces is held against what the contract's nodes offer and ask for."""

from dataclasses import replace

import pytest

from cspm_msgs_py.topics import BRAKE, CLOCK
from cspm_ros.check_drivers.driver_endpoints import (
    Endpoint,
    check_brake,
    check_clock,
    check_publishers,
    check_torque_command,
)

BAR, TORQUE = "/bar/pose", "/winches/torque_command"


@pytest.fixture
def bar(thesis):
    return thesis.topics[BAR]


@pytest.fixture
def torque(thesis):
    return thesis.topics[TORQUE]


@pytest.fixture
def mocap(bar):
    return Endpoint("mocap", bar.ros_type)


@pytest.fixture
def drive(torque):
    return Endpoint("rack/drive", torque.ros_type)


@pytest.fixture
def brake():
    return Endpoint("brake_box", BRAKE.ros_type)


def reported(findings):
    return [(finding.check, finding.ok, finding.text) for finding in findings]


class TestPublishers:
    def test_a_reliable_one_is_named(self, bar, mocap):
        assert reported(check_publishers(bar, [mocap])) == [("qos", True, "reliable, from mocap")]

    def test_keeping_messages_does_no_harm(self, bar, mocap):
        assert reported(check_publishers(bar, [replace(mocap, transient_local=True)])) == [
            ("qos", True, "reliable, from mocap")
        ]

    def test_best_effort_is_refused_and_named(self, bar, mocap):
        other = replace(mocap, node="second", reliable=False)
        text = "best effort (from second), expected reliable: no controller hears it"
        assert reported(check_publishers(bar, [mocap, other])) == [("qos", False, text)]

    def test_another_type_is_left_to_the_check_of_types(self, bar, mocap):
        other = replace(mocap, ros_type="geometry_msgs/msg/Pose", reliable=False)
        assert check_publishers(bar, [other]) == check_publishers(bar, []) == []


class TestTorqueCommand:
    def test_a_drive_that_hears_is_named(self, torque, drive):
        assert reported(check_torque_command(torque, [], [drive])) == [
            ("hearers", True, "heard by rack/drive"),
            ("publishers", True, "nobody gives it now"),
        ]

    def test_one_that_gives_it_is_named(self, torque, drive):
        giver = replace(drive, node="force_controller")
        assert reported(check_torque_command(torque, [giver], [drive]))[1] == (
            *("publishers", True, "given by force_controller"),
        )

    def test_two_that_give_it_are_wrong(self, torque, drive):
        givers = [replace(drive, node=name) for name in ("joystick", "force_controller")]
        text = "2 publishers (force_controller, joystick), expected at most 1"
        assert reported(check_torque_command(torque, givers, [drive]))[1] == (
            "publishers",
            False,
            text,
        )

    def test_nobody_hearing_is_wrong(self, torque):
        text = "nobody hears it, expected: the drives (sensor_msgs/msg/JointState)"
        assert reported(check_torque_command(torque, [], []))[0] == ("hearers", False, text)

    def test_a_drive_of_another_type_is_wrong(self, torque, drive):
        other = replace(drive, ros_type="std_msgs/msg/Float64MultiArray")
        text = "rack/drive expects std_msgs/msg/Float64MultiArray, sent is " + torque.ros_type
        assert reported(check_torque_command(torque, [], [other]))[0] == ("type", False, text)

    def test_a_drive_that_asks_for_the_past_hears_nothing(self, torque, drive):
        other = replace(drive, transient_local=True)
        text = "rack/drive requests transient local, expected volatile: it hears nothing"
        found = reported(check_torque_command(torque, [], [other, drive]))
        assert found[:2] == [("qos", False, text), ("hearers", True, "heard by rack/drive")]

    def test_a_drive_of_best_effort_hears(self, torque, drive):
        found = check_torque_command(torque, [], [replace(drive, reliable=False)])
        assert all(finding.ok for finding in found)


class TestBrake:
    def test_who_hears_is_named(self, brake):
        for needed in (True, False):
            assert reported(check_brake([brake], needed=needed)) == [
                ("hearers", True, "heard by brake_box")
            ]

    def test_without_brakes_the_safe_state_decides(self):
        text = "nobody hears it, but the scenario's safe state is brake"
        assert reported(check_brake([], needed=True)) == [("hearers", False, text)]
        text = "nobody hears it; the safe state hold needs no brakes"
        assert reported(check_brake([], needed=False)) == [("hearers", True, text)]

    def test_one_of_another_type_is_wrong_whatever_the_safe_state(self, brake):
        other = replace(brake, ros_type="std_msgs/msg/Int8")
        text = "brake_box expects std_msgs/msg/Int8, sent is std_msgs/msg/Bool"
        for needed in (True, False):
            assert reported(check_brake([other], needed=needed)) == [("type", False, text)]


class TestClock:
    giver = Endpoint("gazebo", CLOCK.ros_type, reliable=False)

    def test_without_one_nothing_is_said(self):
        assert check_clock(0, [], wanted=False) == []

    def test_one_that_is_not_followed_is_asked_about(self):
        text = "given by gazebo: do the stamps follow it? then check with --sim-time"
        assert reported(check_clock(0, [self.giver], wanted=False)) == [("ticks", None, text)]

    def test_one_that_is_followed_is_counted(self):
        text = "100 messages, from gazebo"
        assert reported(check_clock(100, [self.giver], wanted=True)) == [("ticks", True, text)]

    def test_one_that_is_silent_is_missed(self):
        [(check, ok, text)] = reported(check_clock(0, [self.giver], wanted=True))
        assert (check, ok) == ("ticks", False)
        assert text.startswith("no messages, expected with --sim-time; stamps are compared with ")
