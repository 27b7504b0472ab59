"""`cspm check-drivers`: what it says of drivers that send over real ROS topics."""

import json
import signal
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, lab_of
from ros_graph import load_ros, new_domain
from terminal import Terminal

load_ros()

from driver_publisher import SLOW, Drivers, slowed  # noqa: E402 - ROS is there

from cspm_msgs_py.topics import contract_topics  # noqa: E402

CSPM = Path(sys.executable).with_name("cspm")
MOVING = ("winch_frame.motion.ramp=1.0", "target.motion.ramp=1.0")
TORQUE, BRAKE = "/winches/torque_command", "/winches/brake"
DEGREES = 57.29577951308232
HAND = 15.0  # N
# On a loaded computer messages come late, whoever sends them.
LOAD = {"late"}


@pytest.fixture
def domain(monkeypatch):
    found = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(found))
    monkeypatch.setattr("cspm_ros.runtime.discovery.Discovery.LONGEST_S", 3.0)
    return found


@pytest.fixture
def captured(capfd):
    """rclpy's executor wants a file for stderr."""
    return capfd


@pytest.fixture
def checked(cspm, domain, tmp_path):
    """Check a lab's drivers; return exit code, what was printed, errors by topic and check,
    and all data."""

    def call(lab, scenario, *arguments, seconds=3.0, **options):
        with Drivers(lab, domain, **options):
            given = ("--scenario", scenario, *SLOW, "--for", seconds, "--json", "out.json")
            code, out, err = cspm("check-drivers", *given, *arguments)
        assert err == ""
        data = json.loads((tmp_path / "out.json").read_text())
        errors = {
            (name, each["check"]): each["text"]
            for name, topic in data["topics"].items()
            for each in topic["findings"]
            if each["ok"] is False
        }
        assert (code == 0, data["ok"]) == (not errors, not errors)
        assert all(text in out for text in errors.values())
        return code, out, errors, data

    return call


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    return slowed(lab_of(tmp_path_factory.mktemp("rest") / "r", "rest", "duration=5.0"))


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea") / "r"
    lab = lab_of(folder, "worst_case", "duration=25.0", *MOVING)
    return slowed(lab.window(1.0, 25.0))


def but_load(errors):
    return {(topic, check) for topic, check in errors if check not in LOAD}


class TestDrivers:
    def test_healthy_drivers_of_a_moving_bar_have_no_error(self, checked, sea):
        _, out, errors, data = checked(sea, "worst_case")
        assert but_load(errors) == set()
        assert list(data["topics"]) == [FRAME, BAR, WINCHES, TENSION, TORQUE, BRAKE]
        assert all(data["topics"][name]["messages"] > 20 for name in sea.feeds)
        assert (data["testbed"], data["scenario"]) == ("thesis_refitted", "worst_case")
        assert (data["seconds"], data["complete"]) == (3.0, True)
        rows = dict(line.split()[:2] for line in out.splitlines() if line.startswith("  /"))
        assert rows == {name: topic["verdict"] for name, topic in data["topics"].items()}

    def test_each_misfit_is_named(self, checked, rest):
        names = rest.testbed.cable_names[::-1]
        other = contract_topics(names, has_bar=True, has_winch_frame=True)[WINCHES]
        lab = (
            rest.without(FRAME)
            .but(WINCHES, lambda feed: replace(feed, topic=other))
            .but(TENSION, lambda feed: rest.feeds[BAR].described(name=TENSION))
        )
        code, _, errors, data = checked(
            lab, "rest", best_effort=[BAR], doubled=[WINCHES], drive=False, seconds=2.0
        )
        assert code == 1
        assert but_load(errors) >= {
            (FRAME, "present"),
            (TENSION, "type"),
            (BAR, "qos"),
            (WINCHES, "publishers"),
            (WINCHES, "names"),
            (TORQUE, "hearers"),
        }
        assert errors[FRAME, "present"].startswith("nobody publishes it, expected geometry_msgs/")
        assert errors[TENSION, "type"] == (
            "type geometry_msgs/msg/PoseStamped, expected sensor_msgs/msg/JointState"
        )
        assert errors[BAR, "qos"].startswith("best effort (from lab), expected reliable")
        assert errors[WINCHES, "publishers"] == "2 publishers, expected 1: their messages mix"
        assert "all messages: order sway_4 sway_3 " in errors[WINCHES, "names"]
        assert data["topics"][WINCHES]["publishers"] == 2

    @pytest.mark.slow
    def test_degrees_are_found_by_the_geometry(self, checked, sea):
        lab = sea.but(WINCHES, lambda feed: feed.scaled(DEGREES, slice(0, 16)))
        code, _, errors, _ = checked(lab, "worst_case", seconds=4.0)
        assert code == 1
        reported = "is the angle that the poses give, but in degrees"
        assert errors[WINCHES, "length"].endswith(reported)

    @pytest.mark.slow
    def test_a_misnamed_topic_is_found(self, checked, rest):
        lab = rest.but(BAR, lambda feed: feed.described(name="/mocap/bar"))
        code, _, errors, _ = checked(lab, "rest", seconds=2.0)
        assert code == 1
        assert errors[BAR, "present"].endswith("of that type there is /mocap/bar: remap it?")

    @pytest.mark.slow
    def test_a_simulation_is_checked_on_its_own_clock(self, checked, rest):
        _, _, errors, _ = checked(rest, "rest", "--sim-time", sim_start_ns=10**9)
        assert but_load(errors) == set()
        _, _, errors, data = checked(rest, "rest", sim_start_ns=10**9)
        assert {(name, "clock") for name in rest.feeds} <= set(errors)
        assert data["topics"]["/clock"]["verdict"] == "warning"

    @pytest.mark.slow
    def test_where_nobody_sends_it_says_where_it_listened(self, checked, domain, rest):
        lab = rest.without(FRAME).without(BAR).without(WINCHES).without(TENSION)
        code, out, errors, _ = checked(lab, "rest")
        assert code == 1
        assert {(name, "present") for name in rest.feeds} == set(errors)
        assert f"nothing was heard on ROS_DOMAIN_ID {domain}, ROS_AUTOMATIC_DISCOVERY_" in out

    @pytest.mark.slow
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_a_signal_ends_it_early(self, domain, rest, tmp_path, number):
        words = [CSPM, "check-drivers", "--scenario", "rest", *SLOW, "--for", "300"]
        with Drivers(rest, domain), Terminal(*words, "--json", tmp_path / "out.json") as terminal:
            terminal.wait_for(r"listening to thesis .* [1-9]\d*\.\d of 300\.0 s")
            terminal.signal(number)
            assert terminal.end() == 1
        assert "ended early" in terminal.text
        data = json.loads((tmp_path / "out.json").read_text())
        assert not data["complete"]
        assert data["topics"][TENSION]["messages"] > 0


@pytest.mark.slow
class TestPull:
    def test_a_person_is_led_and_swapped_cables_are_found(self, domain, rest, tmp_path):
        given = ("--for", "2", "--pull", "surge_2,sway_1", "--json", tmp_path / "out.json")
        words = (CSPM, "check-drivers", "--scenario", "rest", *SLOW, *given)
        with Drivers(rest, domain) as drivers, Terminal(*words) as terminal:
            for cable, answering in (("surge_2", "surge_2"), ("sway_1", "sway_3")):
                terminal.wait_for(f"then pull cable {cable} by hand(.|\n)*Enter: begin")
                terminal.press(b"\n")
                terminal.wait_for(f"pull {cable} now")
                drivers.pulled = HAND * (drivers.cables == answering)
                terminal.wait_for("rose by ")
                drivers.pulled = 0.0
            assert terminal.end() == 1
        data = json.loads((tmp_path / "out.json").read_text())
        assert [(each["cable"], each["ok"]) for each in data["pulls"]] == [
            ("surge_2", True),
            ("sway_1", False),
        ]
        assert data["pulls"][1]["answered"] == {"tension": "sway_3"}
        assert not data["ok"]
        assert "pulled sway_1, but the tension of sway_3 rose by " in terminal.text

    def test_q_ends_it(self, domain, rest):
        words = ("check-drivers", "--scenario", "rest", *SLOW, "--for", "1", "--pull", "all")
        with Drivers(rest, domain), Terminal(CSPM, *words) as terminal:
            terminal.wait_for("Enter: begin")
            terminal.press(b"q")
            assert terminal.end() == 1
        assert "ended early" in terminal.text

    def test_without_drivers_nobody_is_asked_to_pull(self, domain, rest):
        words = ("check-drivers", "--scenario", "rest", "--for", "1", "--pull", "all")
        with Terminal(CSPM, *words) as terminal:
            assert terminal.end() == 1
        assert "nothing was heard on ROS_DOMAIN_ID" in terminal.text
        assert "Enter" not in terminal.text
