"""The URDF as MuJoCo, another reader of the format, understands it."""

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cspm_model.scene.urdf import PLUGIN, attachment_link, exit_link, urdf
from cspm_msgs_py.testbed import load_testbed, parse_testbed

TESTBEDS = Path(__file__).parents[3] / "scenarios" / "testbeds"
FILES = sorted(TESTBEDS.glob("*.yaml"))
# MuJoCo wants masses everywhere, and otherwise joins fixed links to their parents.
FOR_MUJOCO = (
    '<mujoco><compiler boundmass="1e-6" boundinertia="1e-9" fusestatic="false"'
    ' discardvisual="false" balanceinertia="false"/></mujoco></robot>'
)
# From world_ned to world, whose z points up.
UP = np.diag([1.0, -1.0, -1.0])


def machine(name):
    return load_testbed(TESTBEDS / f"{name}.yaml").testbed


def read(testbed, **poses):
    """Return MuJoCo's model, its floating bodies fixed at x y z φ θ ψ."""
    robot = ET.fromstring(urdf(testbed))
    for joint in robot.iterfind("joint[@type='floating']"):
        pose = poses.get(joint.find("child").get("link"), np.zeros(6))
        joint.set("type", "fixed")
        joint.find("origin").set("xyz", " ".join(map(str, pose[:3])))
        joint.find("origin").set("rpy", " ".join(map(str, pose[3:])))
    text = ET.tostring(robot, encoding="unicode").replace("</robot>", FOR_MUJOCO)
    return mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_machine_of_the_library_is_read_with_all_its_winches(path):
    testbed = load_testbed(path).testbed
    model = read(testbed)
    for cable in testbed.cable_names:
        joint = model.joint(cable)
        assert joint.type[0] == mujoco.mjtJoint.mjJNT_HINGE
        assert not joint.limited[0]


def test_points_are_where_the_model_has_them():
    testbed = machine("thesis")
    bar = np.array([0.1, -0.2, 1.9, 0.2, -0.1, 0.3])
    frame = np.array([0.3, 0.1, 0.2, 0.1, 0.2, -0.3])
    model = read(testbed, bar_ned=bar, winch_frame_ned=frame)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for cable in testbed.cables:
        for link, point, pose in (
            (exit_link(cable.name), cable.exit, frame),
            (attachment_link(cable.name), cable.attachment, bar),
        ):
            in_ned = pose[:3] + Rotation.from_euler("ZYX", pose[:2:-1]).apply(point)
            np.testing.assert_allclose(data.body(link).xpos, UP @ in_ned, atol=1e-12)
    # Depth is down: a frame with its sign inverted would put the bar above the winches.
    assert data.body("bar_ned").xpos[2] < data.body("hoist_1_exit").xpos[2]


def test_mass_and_inertia_are_the_bars():
    testbed = machine("thesis")
    model = read(testbed)
    body = model.body("bar_ned")
    assert body.mass[0] == testbed.bar.mass
    np.testing.assert_allclose(
        np.sort(body.inertia), np.linalg.eigvalsh(testbed.bar.inertia.matrix), rtol=1e-9
    )


def test_products_of_inertia_and_the_centre_of_mass_are_carried():
    text = (TESTBEDS / "thesis.yaml").read_text(encoding="utf-8")
    text = text.replace("com: [0.0, 0.0, 0.0]", "com: [0.01, 0.02, -0.03]")
    text = re.sub(
        r"(    ixx: \{value: )1.11563e-3", r"    ixy: 0.001\n    iyz: -0.002\n\g<1>0.01", text
    )
    testbed = parse_testbed(text, "tilted").testbed
    body = read(testbed).body("bar_ned")
    np.testing.assert_allclose(body.ipos, testbed.bar.com)
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, body.iquat)
    axes = axes.reshape(3, 3)
    found = axes @ np.diag(body.inertia) @ axes.T
    np.testing.assert_allclose(found, testbed.bar.inertia.matrix, atol=1e-9)


def test_ros2_control_finds_torques_and_their_limits():
    testbed = machine("thesis")
    system = ET.fromstring(urdf(testbed)).find("ros2_control")
    assert system.get("type") == "system"
    assert system.findtext("hardware/plugin") == PLUGIN
    values = {each.get("name"): each.text for each in system.iterfind("hardware/param")}
    assert values == {
        "joint_commands_topic": "/winches/torque_command",
        "joint_states_topic": "/winches/state",
        "trigger_joint_command_threshold": "-1",
    }
    topics = testbed.topics
    joints = {joint.get("name"): joint for joint in system.iterfind("joint")}
    # In the order of the messages, whose names the machine checks.
    assert tuple(joints) == topics["/winches/torque_command"].joint_names
    for cable in testbed.cables:
        joint = joints[cable.name]
        assert [each.get("name") for each in joint.iterfind("command_interface")] == ["effort"]
        assert [each.get("name") for each in joint.iterfind("state_interface")] == [
            "position",
            "velocity",
            "effort",
        ]
        assert float(joint.findtext("command_interface/param[@name='max']")) == cable.torque_limit
        assert float(joint.findtext("command_interface/param[@name='min']")) == -cable.torque_limit


def test_a_machine_without_a_bar_has_neither_bar_nor_target():
    links = {each.get("name") for each in ET.fromstring(urdf(machine("one_winch"))).iter("link")}
    assert not links & {"bar_ned", "target_ned"}
    links = {each.get("name") for each in ET.fromstring(urdf(machine("thesis"))).iter("link")}
    assert {"bar_ned", "target_ned", "winch_frame_ned"} <= links
