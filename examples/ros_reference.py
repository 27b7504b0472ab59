"""References from a ROS node of one's own: `--mode processes --own-node wave_trajectory`."""

import math

import rclpy
from geometry_msgs.msg import Transform, Twist, Vector3
from rosgraph_msgs.msg import Clock
from trajectory_msgs.msg import MultiDOFJointTrajectory as Reference
from trajectory_msgs.msg import MultiDOFJointTrajectoryPoint as Point

rclpy.init()
node = rclpy.create_node("wave_trajectory")
BODIES = {"winch_frame": (0.0, 0.0), "bar": (0.02, 2.0)}  # how far in surge and how deep, m
senders = {body: node.create_publisher(Reference, f"/{body}/reference", 100) for body in BODIES}


def answer(message):
    turn = message.clock.sec + 1e-9 * message.clock.nanosec  # at 1 rad/s
    for body, (size, depth) in BODIES.items():
        x, v, a = size * (1 - math.cos(turn)), size * math.sin(turn), size * math.cos(turn)
        place, speed, growth = (Vector3(x=value) for value in (x, v, a))
        place.z = depth
        motion = [Transform(translation=place)], [Twist(linear=speed)], [Twist(linear=growth)]
        point = Point(transforms=motion[0], velocities=motion[1], accelerations=motion[2])
        reference = Reference(joint_names=[f"{body}_ned"], points=[point])
        reference.header.stamp, reference.header.frame_id = message.clock, "world_ned"
        senders[body].publish(reference)


node.create_subscription(Clock, "/clock", answer, 100)
rclpy.spin(node)
