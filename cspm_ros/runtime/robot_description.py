"""The machine's URDF as a topic, for tools that draw it."""

from __future__ import annotations

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.topics import ROBOT_DESCRIPTION


def publish_description(node: ContractNode, urdf: str) -> None:
    """Publish an URDF document once; whoever comes later gets it too."""
    message, qos = ros_class(ROBOT_DESCRIPTION.ros_type), contract_qos(1, latched=True)
    made = node.node.create_publisher(message, local(ROBOT_DESCRIPTION.name), qos)
    made.publish(message(data=urdf))
