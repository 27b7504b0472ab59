"""The machine's URDF as a topic, for tools that draw it."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos

DESCRIPTION = "/robot_description"


def publish_description(node: ContractNode, urdf: str) -> None:
    """Publish an URDF document once; whoever comes later gets it too."""
    message, qos = ros_class("std_msgs/msg/String"), contract_qos(1)
    qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
    node.node.create_publisher(message, local(DESCRIPTION), qos).publish(message(data=urdf))
