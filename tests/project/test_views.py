"""The layouts that are shipped: made by their script, and of topics that there are."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from cspm_model.scene.urdf import ROOT as WORLD
from cspm_msgs_py.ros_types import typestore
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import SCENE
from cspm_msgs_py.yaml_file import read_yaml

ROOT = Path(__file__).resolve().parents[2]
VIEWS = ROOT / "launch" / "views"
SCRIPT = ROOT / "docs" / "scripts" / "viewer_layouts.py"


@pytest.fixture(scope="module")
def topics():
    testbed = load_testbed(ROOT / "scenarios" / "testbeds" / "thesis.yaml").testbed
    return {**testbed.topics, **SCENE}


def test_the_files_are_those_of_the_script(loaded, tmp_path):
    """Foxglove's own kit writes its layout, so that its form is that of Foxglove."""
    loaded(SCRIPT).main("thesis", tmp_path)
    for made in tmp_path.iterdir():
        assert made.read_text() == (VIEWS / made.name).read_text(), made.name
    assert len(list(tmp_path.iterdir())) == len(list(VIEWS.iterdir())) == 3


def test_a_machine_without_cables_in_space_has_layouts_too(loaded, tmp_path):
    loaded(SCRIPT).main("one_winch", tmp_path)
    assert "/cables/tension/" in (tmp_path / "plotjuggler.xml").read_text()


def check_path(topics, path):
    """Follow a message path such as `/bar/pose.pose.position.x` through the types' fields."""
    name, *fields = path.split(".")
    ros_type = topics[name].ros_type
    for field in fields:
        bare = re.sub(r"\[\d+\]$", "", field)
        found = dict(typestore().fielddefs[ros_type][1])[bare]
        while not isinstance(found[1], str) and len(found[1]) == 2 and found[0] > 2:
            found = found[1][0]
        ros_type = found[1]
    assert not isinstance(ros_type, str), f"{path} is no number"


def found_values(content, key):
    """Return what is under a key, anywhere."""
    if isinstance(content, dict):
        own = [content[key]] if isinstance(content.get(key), str) else []
        return own + [v for each in content.values() for v in found_values(each, key)]
    if isinstance(content, list):
        return [v for each in content for v in found_values(each, key)]
    return []


def test_foxglove_shows_what_is_recorded(topics):
    layout = json.loads((VIEWS / "foxglove.json").read_text())
    paths = found_values(layout, "value")
    assert len(paths) == 22
    for path in paths:
        check_path(topics, path)
    assert found_values(layout, "followTf") == [WORLD]
    assert found_values(layout, "topic") == ["/robot_description"]
    assert found_values(layout, "topicToRender") == ["/diagnostics"]
    with pytest.raises(KeyError):
        check_path(topics, "/bar/pose.pose.place.x")
    with pytest.raises(AssertionError):
        check_path(topics, "/bar/pose.pose.position")


def test_plotjuggler_draws_curves_of_topics_that_there_are(topics):
    """It names a JointState's numbers TOPIC/JOINT/PART, others' by their fields."""
    curves = [each.get("name") for each in ET.parse(VIEWS / "plotjuggler.xml").iter("curve")]
    assert len(curves) == 19
    joints = {
        f"{name}/{joint}/{part}"
        for name, topic in topics.items()
        for joint in topic.joint_names
        for part in topic.parts
    }
    for curve in curves:
        if curve in joints:
            continue
        name = next(name for name in topics if curve.startswith(f"{name}/pose/"))
        check_path(topics, f"{name}.{curve.removeprefix(f'{name}/').replace('/', '.')}")


def test_rviz_shows_the_scene_below_the_root():
    content = read_yaml(VIEWS / "cspm.rviz")["Visualization Manager"]
    assert content["Global Options"]["Fixed Frame"] == WORLD
    shown = {display["Name"]: display for display in content["Displays"]}
    assert shown["Machine"]["Description Topic"]["Value"] in SCENE
    assert shown["Machine"]["Description Topic"]["Durability Policy"] == "Transient Local"
    assert shown["Cables"]["Topic"]["Value"] in SCENE
    assert all(display["Enabled"] for display in content["Displays"])
