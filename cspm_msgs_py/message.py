"""One message of a contract topic, built from its stamp and row, and back to its topic.

Rows as in `cspm_msgs_py.topics`. The messages are `rosbags` classes: no ROS needed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import message_class
from cspm_msgs_py.topics import ACCELERATION, POSE, TWIST, WRENCH, Topic

NANOSECONDS = 1_000_000_000
PARTS = ("position", "velocity", "effort")

Row = NDArray[np.float64]


def time_of(stamp_ns: int) -> Any:  # noqa: ANN401 - classes are generated at run time
    """Return a stamp as `builtin_interfaces/Time`."""
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
    return message_class("builtin_interfaces/msg/Time")(seconds, nanoseconds)


def header_of(stamp_ns: int, frame_id: str) -> Any:  # noqa: ANN401 - see time_of
    """Return a `std_msgs/Header`."""
    return message_class("std_msgs/msg/Header")(time_of(stamp_ns), frame_id)


def message_of(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    """Return the message of `topic` that is valid at `stamp_ns` and carries `row`, shape (width,).

    Raises:
        InputError: the topic's type carries no row.
    """
    if topic.ros_type not in _BUILDERS:
        raise InputError(
            f"{topic.name}: {topic.ros_type} carries no row of numbers, allowed:"
            f" {', '.join(_BUILDERS)}"
        )
    return _BUILDERS[topic.ros_type](topic, stamp_ns, np.asarray(row, dtype=np.float64))


def carries_row(ros_type: str) -> bool:
    """Return whether messages of this type are a stamp and a row of numbers."""
    return ros_type in _BUILDERS


def topic_of(name: str, message: Any) -> Topic:  # noqa: ANN401 - see time_of
    """Return the topic of which `message` is one: its frame, names and columns.

    Raises:
        InputError: the type carries no row, or the message not one per joint.
    """
    ros_type = message.__msgtype__
    if ros_type == "rosgraph_msgs/msg/Clock":
        return Topic(name, ros_type, "", ())
    if ros_type in _COLUMNS:
        return Topic(name, ros_type, message.header.frame_id, _COLUMNS[ros_type])
    if ros_type == "sensor_msgs/msg/JointState":
        return _joint_topic(name, message)
    if ros_type == "trajectory_msgs/msg/MultiDOFJointTrajectory":
        return _reference_topic(name, message)
    raise InputError(
        f"{name}: {ros_type} carries no row of numbers, allowed: {', '.join(_BUILDERS)}"
    )


def _joint_topic(name: str, message: Any) -> Topic:  # noqa: ANN401 - see time_of
    joints = tuple(message.name)
    parts = tuple(part for part in PARTS if len(getattr(message, part)))
    for part in parts:
        count = len(getattr(message, part))
        if count != len(joints):
            raise InputError(
                f"{name}: {part} has {count} values for {len(joints)} names, allowed: one each"
            )
    fields = tuple(f"{part}/{joint}" for part in parts for joint in joints)
    return Topic(name, message.__msgtype__, message.header.frame_id, fields, joints, parts)


def _reference_topic(name: str, message: Any) -> Topic:  # noqa: ANN401 - see time_of
    allowed = "allowed: one point with one transform, velocity and acceleration"
    if len(message.points) != 1:
        raise InputError(f"{name}: a trajectory of {len(message.points)} points, {allowed}")
    for part in ("transforms", "velocities", "accelerations"):
        count = len(getattr(message.points[0], part))
        if count != 1:
            raise InputError(f"{name}: a point with {count} {part}, {allowed}")
    frame, names = message.header.frame_id, tuple(message.joint_names)
    return Topic(name, message.__msgtype__, frame, POSE + TWIST + ACCELERATION, names)


def _vector(values: Row) -> Any:  # noqa: ANN401 - see time_of
    return message_class("geometry_msgs/msg/Vector3")(*map(float, values))


def _quaternion(values: Row) -> Any:  # noqa: ANN401 - see time_of
    return message_class("geometry_msgs/msg/Quaternion")(*map(float, values))


def _twist(values: Row) -> Any:  # noqa: ANN401 - see time_of
    return message_class("geometry_msgs/msg/Twist")(_vector(values[:3]), _vector(values[3:]))


def _clock(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    return message_class(topic.ros_type)(time_of(stamp_ns))


def _pose_stamped(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    point = message_class("geometry_msgs/msg/Point")(*map(float, row[:3]))
    pose = message_class("geometry_msgs/msg/Pose")(point, _quaternion(row[3:]))
    return message_class(topic.ros_type)(header_of(stamp_ns, topic.frame_id), pose)


def _twist_stamped(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    return message_class(topic.ros_type)(header_of(stamp_ns, topic.frame_id), _twist(row))


def _wrench_stamped(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    wrench = message_class("geometry_msgs/msg/Wrench")(_vector(row[:3]), _vector(row[3:]))
    return message_class(topic.ros_type)(header_of(stamp_ns, topic.frame_id), wrench)


def _joint_state(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    columns = iter(row.reshape(len(topic.parts), len(topic.joint_names)))
    values = [next(columns) if part in topic.parts else np.zeros(0) for part in PARTS]
    header = header_of(stamp_ns, topic.frame_id)
    return message_class(topic.ros_type)(header, list(topic.joint_names), *values)


def _reference(topic: Topic, stamp_ns: int, row: Row) -> Any:  # noqa: ANN401 - see time_of
    transform = message_class("geometry_msgs/msg/Transform")(
        _vector(row[:3]), _quaternion(row[3:7])
    )
    point = message_class("trajectory_msgs/msg/MultiDOFJointTrajectoryPoint")(
        [transform],
        [_twist(row[7:13])],
        [_twist(row[13:])],
        message_class("builtin_interfaces/msg/Duration")(0, 0),
    )
    header = header_of(stamp_ns, topic.frame_id)
    return message_class(topic.ros_type)(header, list(topic.joint_names), [point])


_COLUMNS = {
    "geometry_msgs/msg/PoseStamped": POSE,
    "geometry_msgs/msg/TwistStamped": TWIST,
    "geometry_msgs/msg/WrenchStamped": WRENCH,
}

_BUILDERS: dict[str, Callable[[Topic, int, Row], Any]] = {
    "rosgraph_msgs/msg/Clock": _clock,
    "geometry_msgs/msg/PoseStamped": _pose_stamped,
    "geometry_msgs/msg/TwistStamped": _twist_stamped,
    "geometry_msgs/msg/WrenchStamped": _wrench_stamped,
    "sensor_msgs/msg/JointState": _joint_state,
    "trajectory_msgs/msg/MultiDOFJointTrajectory": _reference,
}
