"""What meets a ROS 2 graph, from Python: bags replayed, a node run, drivers checked."""

import pytest
from driver_samples import BAR, lab_of
from ros_graph import assert_same, load_ros, new_domain
from run_samples import bundle_of

load_ros()

from driver_publisher import SLOW, Drivers, slowed  # noqa: E402 - ROS is there

import cspm  # noqa: E402
from cspm import graph  # noqa: E402
from cspm_run.recorded_run import run  # noqa: E402

STEPS = 50


@pytest.fixture(autouse=True)
def domain(monkeypatch):
    found = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(found))
    monkeypatch.setattr("cspm_ros.runtime.discovery.Discovery.LONGEST_S", 3.0)
    return found


@pytest.fixture(autouse=True)
def captured(capfd):
    """rclpy's executor wants a file for stderr."""
    return capfd


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording") / "calm"
    run(bundle_of("calm"), folder, steps=STEPS)
    return folder


def test_a_bag_is_played_to_the_graph(recording):
    reported = []
    found = graph.replay(
        recording,
        topics=["/bar/pose"],
        start=0.02,
        duration=0.02,
        rate=2.0,
        progress=lambda *each: reported.append(each),
    )
    assert (found.ok, found.messages, found.interrupted) == (True, 40, False)
    assert found.duration == pytest.approx(0.019)
    assert found.data() == {
        "bag": str(recording),
        "messages": 40,
        "played_s": found.duration,
        "interrupted": False,
        "unplayable": {},
    }
    assert reported[-1] == (pytest.approx(0.95, abs=0.06), "replaying")


def test_a_recording_is_replayed_through_nodes_and_recorded(recording, tmp_path):
    found = graph.replay(cspm.open(recording), through="all", out=tmp_path / "again")
    assert found.identical
    assert found.data()["reproduced"]["/wrench_command"]["messages"] == STEPS
    assert_same(recording, tmp_path / "again")


def test_changed_values_are_found_to_differ(recording):
    gain = "control.force.gains.hoist_1.kp=0.5"
    found = graph.replay(recording, through=["force_controller"], overrides=[gain])
    assert (found.identical, found.ok) == (False, False)
    assert found.reproductions["/winches/torque_command"].first.field == "effort/hoist_1"


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"rate": -1.0}, "^rate -1: allowed: 0.001 to 1000, or 0 with nodes in step$"),
        ({"out": "again"}, "^out without through: allowed: with it$"),
        ({"overrides": ["seed=2"]}, "^changed values without through: allowed: with it$"),
        (
            {"through": "all", "start": 1.0},
            "^through with chosen or renamed topics or a start: allowed: without, since",
        ),
        ({"through": "plant"}, "^through plant: allowed: wave_trajectory, motion_controller, "),
        ({"topics": ["/nope"]}, ": no topic /nope, it has: /clock, "),
    ],
)
def test_a_replay_that_is_not_possible_is_refused(recording, given, line):
    with pytest.raises(cspm.InputError, match=line):
        graph.replay(recording, **given)


def test_a_node_runs_until_its_run_ends(recording):
    given = [f"bag:={recording}", "topics:=['/bar/pose']", "start:=0.04"]
    graph.run_node("player", ["--ros-args", *(word for each in given for word in ("-p", each))])
    with pytest.raises(cspm.InputError, match=r"^node motor: allowed: plant, wave_trajectory, "):
        graph.run_node("motor")
    with pytest.raises(cspm.InputError, match=r"^node plant: -p, allowed: nothing, or --ros-args "):
        graph.run_node("plant", ["-p", "steps:=5"])


def test_drivers_are_checked(domain, tmp_path):
    lab = slowed(lab_of(tmp_path / "r", "rest", "duration=3.0")).without(BAR)
    reported = []
    with Drivers(lab, domain):
        found = graph.check_drivers(
            "rest",
            overrides=[each.removeprefix("--set=") for each in SLOW],
            seconds=1.0,
            progress=lambda *each: reported.append(each),
        )
    assert (found.ok, found.complete, found.heard) == (False, True, True)
    [missing] = [each for each in found.topics[BAR] if each.check == "present"]
    assert missing.text.startswith("nobody publishes it, expected geometry_msgs/")
    assert found.data()["topics"][BAR]["verdict"] == "error"
    assert found.data()["seconds"] == 1.0
    assert reported[0] == (0.0, "looking for drivers")
    assert reported[-1] == (1.0, "listening to thesis")


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({}, "^check-drivers: allowed: a scenario or a test-bed, one of both$"),
        ({"testbed": "thesys"}, "^thesys: no such test-bed, allowed: cogiro"),
        ({"testbed": "thesis", "seconds": 0.5}, "^listening for 0.5 s: allowed: 1 to 300 s$"),
        ({"scenario": "rest", "overrides": ["rates.winches=30"]}, "rates.winches: 30 Hz "),
    ],
)
def test_a_check_that_is_not_possible_is_refused(given, line):
    with pytest.raises(cspm.InputError, match=line):
        graph.check_drivers(**given)
