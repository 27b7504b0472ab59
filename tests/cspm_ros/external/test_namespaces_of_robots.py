"""Two robots in one ROS domain, kept apart by their namespaces alone."""

import pytest
from ros_graph import assert_same, ended_in_any_case, load_ros, new_domain, outcome, start_node
from run_samples import bundle_of

from cspm_msgs_py.schedule import schedule_of
from cspm_run.recorded_run import run

load_ros()

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

STEPS = 1000
# Their seas and noises differ: a message of the other one changes a recording.
ROBOTS = {"robot1": "seed=1", "robot2": "seed=2"}


def test_two_robots_in_one_domain_run_as_if_alone(tmp_path):
    domain = new_domain()
    machine = bundle_of("one_winch")
    names = ["plant", *schedule_of(machine.scenario, machine.testbed.testbed).nodes, "recorder"]
    started = {
        f"{robot}/{name}": start_node(
            name,
            "scenario:=one_winch",
            f"overrides:=[{seed}]",
            f"steps:={STEPS}",
            *[f"folder:={tmp_path / robot}"] * (name == "recorder"),
            domain=domain,
            remap=[f"__ns:=/{robot}"],
        )
        for robot, seed in ROBOTS.items()
        for name in names
    }
    with ended_in_any_case(started) as nodes:
        ends = {name: outcome(process, 120.0) for name, process in nodes.items()}
    assert {(code, err) for code, _, err in ends.values()} == {(0, "")}
    for robot, seed in ROBOTS.items():
        alone = bundle_of("one_winch", seed)
        run(alone, tmp_path / f"{robot}_alone", steps=STEPS)
        assert_same(tmp_path / robot, tmp_path / f"{robot}_alone")
