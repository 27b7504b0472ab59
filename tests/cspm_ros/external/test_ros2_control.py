"""The machine under controllers of ros2_control, whose hardware interface speaks our topics.

Neither ros2_control nor `joint_state_topic_hardware_interface` has a wheel. What stands for it here
publishes and reads as the source of its `JointStateTopicSystem` does: quality of service, names in
the order of the URDF's joints, efforts alone, stamps of the node's own clock.
"""

from contextlib import ExitStack
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from realtime_graph import Evidence, Graph, slow_bundle, warm_processes
from ros_graph import load_ros

from cspm_model.scene.urdf import SYSTEM
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.schedule import PLANT

load_ros()

from rclpy.qos import (  # noqa: E402
    DurabilityPolicy,
    QoSProfile,
    qos_profile_sensor_data,
)

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.realtime, pytest.mark.compiled]

PERIOD_S = 0.005
STEPS = 600
# N·m·s/rad: little for the lightest rotor within a period.
DAMPING = 1e-4


class Control:
    """A controller that holds the first torques, behind the hardware that an URDF describes."""

    def __init__(self, session):
        joint_state, self._node = ros_class("sensor_msgs/msg/JointState"), session.node(SYSTEM).node
        self._new, self.joints, self.sent = joint_state, (), 0
        self.states, self._first = {}, None
        stored = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        text = ros_class("std_msgs/msg/String")
        self._node.create_subscription(text, "robot_description", self._describe, stored)
        self._node.create_timer(PERIOD_S, self._write)

    def _describe(self, message):
        system = ET.fromstring(message.data).find("ros2_control")
        topics = {each.get("name"): each.text for each in system.iterfind("hardware/param")}
        self.joints = [joint.get("name") for joint in system.iterfind("joint")]
        self._commands = self._node.create_publisher(
            self._new, topics["joint_commands_topic"], QoSProfile(depth=1)
        )
        self._node.create_subscription(
            self._new, topics["joint_states_topic"], self._read, qos_profile_sensor_data
        )

    def _read(self, message):
        numbers = zip(message.name, message.velocity, message.effort, strict=True)
        self.states = {name: (speed, effort) for name, speed, effort in numbers}
        self._first = self._first or self.states

    def _write(self):
        if not self.states:
            return
        command = self._new(name=self.joints)
        command.header.stamp = self._node.get_clock().now().to_msg()
        command.effort = [
            self._first[name][1] - DAMPING * self.states[name][0] for name in self.joints
        ]
        self._commands.publish(command)
        self.sent += 1


def test_controllers_of_ros2_control_hold_the_bar(tmp_path):
    bundle = slow_bundle()
    with ExitStack() as stack:
        graph = stack.enter_context(
            Graph(warm_processes(), bundle, tmp_path, members=(PLANT, RECORDER), steps=STEPS)
        )
        session = stack.enter_context(Session(domain_id=graph.domain))
        control = Control(session)
        graph.start()
        assert session.spin_until(lambda: not graph.processes[PLANT].is_alive(), 120.0)
        assert set(graph.join().values()) == {0}
    assert control.joints == list(bundle.testbed.testbed.cable_names)
    with_commands = Evidence(graph.folder)
    commands = with_commands.rows["/winches/torque_command"].rows
    assert 0.5 * STEPS < len(commands) <= control.sent
    winches = with_commands.rows["/winches/state"].rows
    applied = winches[:, -len(control.joints) :]
    # What was commanded is what the machine applied, in the same order.
    np.testing.assert_allclose(applied[-1], commands[-20:].mean(axis=0), atol=0.01)
    pose = with_commands.rows["/bar/pose"].rows
    assert np.abs(pose[-1, :3] - pose[0, :3]).max() < 0.02
    with Recording(graph.folder) as recording:
        assert recording.metadata["cspm"]["mode"] == "realtime"
