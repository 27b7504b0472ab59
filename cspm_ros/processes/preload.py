"""What every node loads sooner or later, loaded at once."""

from __future__ import annotations

from importlib import import_module

from cspm_ros.runtime.ros_install import find_ros
from cspm_sim.effects import catalogue

# Loaded where they are first used, which is after the fork in all nodes.
_LATE = ("scipy.integrate", "scipy.optimize", "scipy.special")
_MESSAGES = (
    "builtin_interfaces/msg/Time",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseStamped",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "type_description_interfaces/msg/TypeDescription",
)


def preload() -> None:
    """Load modules, message types and the compiler's types; start nothing.

    Raises:
        InputError: ROS 2 is not there.
    """
    find_ros("nodes")
    for name in ("cspm_ros.runtime.node_run", *_LATE):
        import_module(name)
    # Their modules load ROS, which comes after looking for it.
    from rclpy.type_support import check_for_type_support

    from cspm_msgs_py.ros.contract_node import ros_class

    for name in _MESSAGES:
        check_for_type_support(ros_class(name))
    catalogue()
    # The first call of any compiled function loads the types of all.
    from cspm_model.kernels.rotation import euler_rate_to_world_rate

    euler_rate_to_world_rate(0.0, 0.0, 0.0, 0.0, 0.0)
