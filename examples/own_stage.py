"""A motion controller as a ROS node: `--mode processes --own-node motion_controller`."""

import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from trajectory_msgs.msg import MultiDOFJointTrajectory

rclpy.init()
node = rclpy.create_node("motion_controller")
sender = node.create_publisher(WrenchStamped, "/wrench_command", 10)
weight, stiffness = 4.0 * 9.81, 100.0  # N, N/m


def control(pose):
    wrench = WrenchStamped(header=pose.header)  # the stamp says to which step it belongs
    wrench.wrench.force.z = stiffness * (2.0 - pose.pose.position.z) - weight
    sender.publish(wrench)


node.create_subscription(MultiDOFJointTrajectory, "/bar/reference", lambda reference: None, 100)
node.create_subscription(PoseStamped, "/bar/pose", control, 100)
rclpy.spin(node)
