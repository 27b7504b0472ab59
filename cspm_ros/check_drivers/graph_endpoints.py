"""Publishers and subscriptions as the ROS graph describes them."""

from __future__ import annotations

from typing import Any

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from cspm_ros.check_drivers.driver_endpoints import Endpoint


def endpoint_of(info: Any) -> Endpoint:  # noqa: ANN401 - rclpy's classes have no types
    """Return what a `TopicEndpointInfo` says."""
    qos = info.qos_profile
    return Endpoint(
        node=f"{info.node_namespace}/{info.node_name}".strip("/"),
        ros_type=info.topic_type,
        reliable=qos.reliability != ReliabilityPolicy.BEST_EFFORT,
        transient_local=qos.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
