"""Every example runs, is short, and is shown on the page as it is."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
# What each prints that shows that it did what it is for.
SHOWN = {
    "first_run": r"identical when repeated: True",
    "find_friction": r"reported winch_coulomb_friction \('sway_3',\)\n  torque = 0\.0[23]\d* N·m",
    "own_controller": r"own: heave error \d\.\d+e-0[345] m RMS",
    "state_space_controller": r"heave error \d\.\d+e-0[34] m RMS",
    "own_reference": r"radius in the end: 0\.(049|050)\d* m",
    "own_effect": r"resisting torque = coefficient.*\nfastest: .* rad/s\nfastest: ",
    "compare_recordings": r"hoist_1: \+\d\.\d+ N more with the heavy bar",
    "identify_winch": r"winch_coulomb_friction torque: 0\.0(19|20)\d* N·m",
    "sweep_gain": r"\n +15 +\d\.\d{4} +\d+\.\d\d\n",
    "read_into_pandas": r"tension/sway_4",
    "linear_analysis": r"torque of hoist_1.*\ngain .*\n.*crosses over at \d+\.\d rad/s",
    "workspace_of_another_robot": r"tower: 8 cables.*\n.*pseudo_inverse: surge 0\.\d",
}
LONGEST = 25
NODE = "own_node"  # ends only when it is requested to
SENDER = """
import rclpy, time
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
rclpy.init()
node = rclpy.create_node("sender")
sender = node.create_publisher(WrenchStamped, "/wrench_command", 10)
message = WrenchStamped(wrench=Wrench(force=Vector3(z=-40.0)))
node.create_timer(0.1, lambda: sender.publish(message))
rclpy.spin(node)
"""


@pytest.fixture
def examples_page(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    import examples_page

    return examples_page


def test_there_are_thirteen_examples_beside_those_of_ros_pages(examples_page):
    names = {path.stem for path in EXAMPLES.glob("*.py")} - {"driver", "own_stage", "ros_reference"}
    assert names == {*SHOWN, NODE} == set(examples_page.ORDER)
    assert len(names) == 13


def test_the_page_is_that_of_the_files(examples_page):
    reported = "run docs/scripts/examples_page.py"
    assert (ROOT / "docs" / "reference" / "examples.md").read_text(
        encoding="utf-8"
    ) == examples_page.page(), reported


@pytest.mark.parametrize("name", [*SHOWN, NODE])
def test_an_example_is_short_and_says_what_it_does(name):
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    assert re.match(r'"""[A-Z].+\."""\n', text)
    assert "import cspm\n" in text


@pytest.fixture
def environment():
    return os.environ | {
        "PYTHONPATH": str(ROOT),
        "MPLBACKEND": "agg",
        "OMP_NUM_THREADS": "1",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": "88",
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", SHOWN)
def test_an_example_runs_in_an_empty_folder(name, tmp_path, environment):
    if name == "read_into_pandas":
        pytest.importorskip("pandas", reason="pandas is not installed")
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    done = subprocess.run(
        [sys.executable, f"examples/{name}.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(SHOWN[name], done.stdout), done.stdout


@pytest.mark.slow
def test_the_node_answers_a_wrench(environment):
    pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    commands = [sys.executable, EXAMPLES / f"{NODE}.py"], [sys.executable, "-c", SENDER]
    node, sender = (
        subprocess.Popen(each, env=environment, stdout=subprocess.PIPE, text=True)
        for each in commands
    )
    try:
        answer = json.loads(node.stdout.readline())
    finally:
        for each in (node, sender):
            each.kill()
            each.communicate()
    assert len(answer) == 8
    assert min(answer) > 2.0
