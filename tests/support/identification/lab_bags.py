"""Bags as laboratories record them, written by `mcap` and `rosbags` alone."""

from pathlib import Path

import numpy as np
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

JAZZY = get_typestore(Stores.ROS2_JAZZY)
EPOCH_NS = 1_769_860_800 * 10**9
STEP_NS = 10_000_000


def made(kind, *values):
    """Return a message."""
    return JAZZY.types[kind](*values)


def header(stamp_ns, frame=""):
    """Return a header."""
    seconds, rest = divmod(int(stamp_ns), 10**9)
    return made("std_msgs/msg/Header", made("builtin_interfaces/msg/Time", seconds, rest), frame)


def joints(stamp_ns, names, position=(), velocity=(), effort=()):
    """Return a JointState."""
    parts = (np.array(part, dtype=float) for part in (position, velocity, effort))
    return made("sensor_msgs/msg/JointState", header(stamp_ns), list(names), *parts)


def vector(*xyz):
    """Return three numbers."""
    return made("geometry_msgs/msg/Vector3", *xyz)


def wrench(stamp_ns, force, frame="cell"):
    """Return what a load cell's driver sends: the force along z."""
    inner = made("geometry_msgs/msg/Wrench", vector(0.0, 0.0, force), vector(0.0, 0.0, 0.0))
    return made("geometry_msgs/msg/WrenchStamped", header(stamp_ns, frame), inner)


def transform(stamp_ns, parent, child, x):
    """Return a transform that is shifted along x."""
    turn = made("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    inner = made("geometry_msgs/msg/Transform", vector(x, 0.0, 0.0), turn)
    return made("geometry_msgs/msg/TransformStamped", header(stamp_ns, parent), child, inner)


def bag(path: Path, messages, *, chunk=1 << 20, compression=CompressionType.NONE, definitions=None):
    """Write an MCAP file of (log time, topic, message); own definitions by type."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for kind, text in (definitions or {}).items():
        store.register(get_types_from_msg(text, kind))
    senders = {}
    with path.open("wb") as file:
        writer = McapWriter(file, chunk_size=chunk, compression=compression)
        writer.start(profile="ros2")
        for log, topic, message in messages:
            kind = message.__msgtype__
            if topic not in senders:
                text = store.generate_msgdef(kind, ros_version=2)[0]
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                senders[topic] = writer.register_channel(topic, "cdr", schema)
            payload = bytes(store.serialize_cdr(message, kind))
            writer.add_message(senders[topic], int(log), payload, int(log))
        writer.finish()
    return path
