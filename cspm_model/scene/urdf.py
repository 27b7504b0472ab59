"""A machine in the Unified Robot Description Format, with the tag of ros2_control.

The root `world` is that of REP 103: x forward, y left, z up; `world_ned` below it has z down, and
all other frames are those of the topics. A winch's joint has the name of its cable, as in
`/winches/state`. Cables are no part of it: the format knows trees of rigid links only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree as ET

from cspm_msgs_py.testbed import Bar, Cable, Testbed
from cspm_msgs_py.topics import BAR_FRAME, TARGET_FRAME, WINCH_FRAME, WORLD_FRAME

ROOT = "world"
# Of ros2_control's hardware that speaks JointState topics, in ROS 2 Jazzy.
PLUGIN = "joint_state_topic_hardware_interface/JointStateTopicSystem"
SYSTEM = "winches"
_COMMANDS, _STATES = "/winches/torque_command", "/winches/state"
_ORIGIN = (0.0, 0.0, 0.0)
# A winch's drum is drawn as wide as its radius.
_DRUM_AXIS = (0.0, 1.0, 0.0)


def urdf(testbed: Testbed) -> str:
    """Return the machine as an URDF document.

    Args:
        testbed: whose numbers are used; lengths in m, masses in kg, inertia in kg·m² at the bar's
            centre of mass, angles and torques at the motor shaft in rad and N·m.
    """
    robot = ET.Element("robot", name=testbed.name)
    _link(robot, ROOT)
    _link(robot, WORLD_FRAME)
    _joint(robot, "fixed", WORLD_FRAME, ROOT, rpy=(math.pi, 0.0, 0.0))
    carrier = anchor = WORLD_FRAME
    if testbed.winch_frame is not None:
        carrier = WINCH_FRAME
        frame = _link(robot, WINCH_FRAME)
        if testbed.winch_frame.dimensions is not None:
            _box(frame, testbed.winch_frame.dimensions)
        _joint(robot, "floating", WINCH_FRAME, WORLD_FRAME)
    if testbed.bar is not None:
        anchor = BAR_FRAME
        _add_bar(robot, testbed.bar)
    for cable in testbed.cables:
        _add_winch(robot, cable, carrier, anchor)
    _add_control(robot, testbed.cables)
    ET.indent(robot)
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def exit_link(cable: str) -> str:
    """Return the name of the link at a cable's exit."""
    return f"{cable}_exit"


def attachment_link(cable: str) -> str:
    """Return the name of the link at a cable's attachment."""
    return f"{cable}_attachment"


def _add_bar(robot: ET.Element, bar: Bar) -> None:
    link = _link(robot, BAR_FRAME)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(bar.com))
    ET.SubElement(inertial, "mass", value=_number(bar.mass))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    moments = {name: _number(getattr(bar.inertia, name)) for name in names}
    ET.SubElement(inertial, "inertia", moments)
    _box(link, bar.dimensions)
    _joint(robot, "floating", BAR_FRAME, WORLD_FRAME)
    _link(robot, TARGET_FRAME)
    _joint(robot, "floating", TARGET_FRAME, WORLD_FRAME)


def _add_winch(robot: ET.Element, cable: Cable, carrier: str, anchor: str) -> None:
    """Add a winch's exit and motor to what carries it, and its cable's attachment."""
    leaves, motor = exit_link(cable.name), f"{cable.name}_motor"
    _link(robot, leaves)
    _joint(robot, "fixed", leaves, carrier, xyz=cable.exit or _ORIGIN)
    visual = ET.SubElement(_link(robot, motor), "visual")
    ET.SubElement(visual, "origin", rpy=_numbers((math.pi / 2.0, 0.0, 0.0)))
    radius = _number(cable.drum_radius)
    drum = ET.SubElement(visual, "geometry")
    ET.SubElement(drum, "cylinder", radius=radius, length=radius)
    joint = _joint(robot, "continuous", motor, leaves, name=cable.name)
    ET.SubElement(joint, "axis", xyz=_numbers(_DRUM_AXIS))
    if cable.attachment is not None:
        _link(robot, attachment_link(cable.name))
        _joint(robot, "fixed", attachment_link(cable.name), anchor, xyz=cable.attachment)


def _add_control(robot: ET.Element, cables: Sequence[Cable]) -> None:
    """Add what ros2_control reads: torques of the winches, and what they report."""
    system = ET.SubElement(robot, "ros2_control", name=SYSTEM, type="system")
    hardware = ET.SubElement(system, "hardware")
    ET.SubElement(hardware, "plugin").text = PLUGIN
    _parameter(hardware, "joint_commands_topic", _COMMANDS)
    _parameter(hardware, "joint_states_topic", _STATES)
    # Otherwise nothing is sent while all motors are at angle 0.
    _parameter(hardware, "trigger_joint_command_threshold", "-1")
    for cable in cables:
        joint = ET.SubElement(system, "joint", name=cable.name)
        command = ET.SubElement(joint, "command_interface", name="effort")
        _parameter(command, "min", _number(-cable.torque_limit))
        _parameter(command, "max", _number(cable.torque_limit))
        for name in ("position", "velocity", "effort"):
            ET.SubElement(joint, "state_interface", name=name)


def _link(robot: ET.Element, name: str) -> ET.Element:
    return ET.SubElement(robot, "link", name=name)


def _joint(
    robot: ET.Element,
    kind: str,
    child: str,
    parent: str,
    *,
    name: str = "",
    xyz: Sequence[float] = _ORIGIN,
    rpy: Sequence[float] = _ORIGIN,
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name or f"{parent}_to_{child}", type=kind)
    ET.SubElement(joint, "origin", xyz=_numbers(xyz), rpy=_numbers(rpy))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _box(link: ET.Element, dimensions: Sequence[float]) -> None:
    geometry = ET.SubElement(ET.SubElement(link, "visual"), "geometry")
    ET.SubElement(geometry, "box", size=_numbers(dimensions))


def _parameter(parent: ET.Element, name: str, value: str) -> None:
    ET.SubElement(parent, "param", name=name).text = value


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Sequence[float]) -> str:
    return " ".join(_number(value) for value in values)
