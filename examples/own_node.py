"""Use cspm's tension distribution in a node of one's own rclpy program."""

import rclpy
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import JointState

import cspm

cables = list(cspm.load_testbed("thesis").cables)
distribution = cspm.builtin_controller("tension_distribution", "calm")
rclpy.init()
node = rclpy.create_node("my_distribution")
sender = node.create_publisher(JointState, "/tension_command", 10)


def allocate(message):
    f, pose = message.wrench.force, [0, 0, 1.8, 0, 0, 0, 1]  # m, quaternion; measured elsewhere
    rows = {"/wrench_command": [f.x, f.y, f.z, 0, 0, 0], "/bar/pose": pose}
    found = distribution.step(0.0, rows)  # N
    sender.publish(JointState(name=cables, effort=found))
    print(found.round(2).tolist(), flush=True)


node.create_subscription(WrenchStamped, "/wrench_command", allocate, 10)
rclpy.spin(node)
