"""Simulating from a script through ROS 2 nodes: the same arrays, and in real time its timing."""

import numpy as np
import pytest
from ros_graph import load_ros, new_domain

load_ros()

import cspm  # noqa: E402 - ROS is there

DURATION = 0.3


@pytest.fixture(autouse=True)
def domain(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(new_domain()))


@pytest.fixture(autouse=True)
def captured(capfd):
    """rclpy's executor wants a file for stderr."""
    return capfd


@pytest.fixture(scope="module")
def inprocess():
    return cspm.simulate("rest", duration=DURATION)


@pytest.mark.parametrize("mode", ["graph", "processes"])
def test_nodes_give_the_arrays_of_a_run_in_process_bit_for_bit(inprocess, mode):
    reported = []
    run = cspm.simulate(
        "rest", duration=DURATION, mode=mode, progress=lambda *each: reported.append(each)
    )
    assert (run.failure, run.interrupted) == (None, False)
    assert run.names == inprocess.names
    for name in run.names:
        one, other = run.signal(name), inprocess.signal(name)
        assert np.array_equal(one.values, other.values), name
        assert np.array_equal(one.time, other.time), name
    assert reported[-1][1] == "simulating"


def test_a_run_in_real_time_has_its_timing(tmp_path):
    """Of a rig whose torques are prescribed, slowly enough for a busy computer."""
    fast = ("plant", "winches", "load_cells", "wave_trajectory", "force_controller")
    rates = {**dict.fromkeys(fast, 200), "motion_capture": 100}
    scenario = cspm.load_scenario("one_winch").with_parameter("rates", rates)
    for name in ("stale_after", "watchdog"):
        scenario = scenario.with_parameter(f"safety.{name}", 10.0)
    run = cspm.simulate(scenario, duration=DURATION, mode="realtime")
    assert run.failure is None
    # A loaded computer ends a run late, never early.
    assert run.duration > DURATION - 0.01
    assert run.tension.shape[1] == 1
    timing = run.summary["realtime"]
    assert timing["recorder"] == {"lost": 0, "refused": 0}
    assert timing["plant"]["deadlines_missed"] >= 0
    # What the nodes recorded goes with the run; what is saved stays.
    assert run.save(tmp_path / "rig").metadata["cspm"]["mode"] == "realtime"
