"""Bags for tests, written by `rosbags` and `mcap`: seeded messages of many types and log times."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

from cspm_msgs_py.bag import BagMessage, open_bag
from cspm_msgs_py.diagnostics import Level, encode_diagnostics
from cspm_msgs_py.message import header_of, message_of, time_of
from cspm_msgs_py.ros_types import definition, deserialize, message_class, serialize, typestore
from cspm_msgs_py.topics import contract_topics

CONTRACT = contract_topics(["hoist_1", "surge_1"], has_bar=True, has_winch_frame=False)
SMALL = 2000  # bytes of a chunk, so that a few hundred messages make many
NOETIC = get_typestore(Stores.ROS1_NOETIC)
START_NS = 1_700_000_000_000_000_000
TEXT, FLAG, EMPTY, SILENT = "/plain/text", "/größe/δ", "/empty", "/silent"
TYPES = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/bar/pose": "geometry_msgs/msg/PoseStamped",
    "/winches/state": "sensor_msgs/msg/JointState",
    "/bar/reference": "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    TEXT: "std_msgs/msg/String",
    FLAG: "std_msgs/msg/Bool",
    EMPTY: "std_msgs/msg/Empty",
    "/camera": "sensor_msgs/msg/CameraInfo",
    SILENT: "sensor_msgs/msg/Imu",
}


class Written(NamedTuple):
    """A message as it was written: log time [ns], topic, and the message."""

    log_ns: int
    topic: str
    message: object


def sample_messages(count: int, seed: int = 0, *, unordered: int = 0) -> list[Written]:
    """Return `count` messages whose log times are ms apart, most shared by several messages.

    `unordered` is by how many ms a message may be logged too early or too late.
    """
    rng = np.random.default_rng(seed)
    names = [name for name in TYPES if name != SILENT]
    written = []
    for i in range(count):
        name = names[rng.integers(len(names))]
        step = i // 4 + (rng.integers(-unordered, unordered + 1) if unordered else 0)
        log = START_NS + int(step) * 1_000_000
        written.append(Written(log, name, _message(name, log - int(rng.integers(10**6)), rng)))
    return written


def in_log_order(written: list[Written]) -> list[Written]:
    """Return messages by log time, those of one log time as they were written."""
    return sorted(written, key=lambda message: message.log_ns)


def _message(name: str, stamp_ns: int, rng: np.random.Generator) -> object:
    if name == "/diagnostics":
        status = [(Level.WARN, "cables/surge_1", "slack", {"tension": str(rng.normal())})]
        return deserialize(encode_diagnostics(stamp_ns, status), TYPES[name])
    if name in CONTRACT:
        return message_of(CONTRACT[name], stamp_ns, rng.normal(size=CONTRACT[name].width))
    kind = message_class(TYPES[name])
    if name == TEXT:
        return kind("Prüfstand " * int(rng.integers(5)))
    if name == FLAG:
        return kind(bool(rng.integers(2)))
    if name == EMPTY:
        return kind(0)
    return _camera_info(kind, stamp_ns, rng)


def _camera_info(kind, stamp_ns, rng):
    region = message_class("sensor_msgs/msg/RegionOfInterest")(1, 2, 3, 4, True)
    numbers = [rng.normal(size=size) for size in (5, 9, 9, 12)]
    return kind(header_of(stamp_ns, "world_ned"), 480, 640, "plumb_bob", *numbers, 1, 2, region)


def to_ros1(message: object) -> object:
    """Return a message as its ROS 1 class, with a sequence number in each header."""
    if isinstance(message, list):
        return [to_ros1(item) for item in message]
    kind = getattr(message, "__msgtype__", None)
    if kind is None:
        return message
    names = [name for name in message.__dataclass_fields__ if not name.startswith("structure_")]
    values = [to_ros1(getattr(message, name)) for name in names]
    number = [4711] if kind == "std_msgs/msg/Header" else []
    return NOETIC.types[kind](*number, *values)


def write_rosbag1(path: Path, written: list[Written], *, compression=None, chunk=1 << 20) -> Path:
    """Write a ROS 1 bag of chunks of about `chunk` bytes."""
    writer = Rosbag1Writer(path)
    writer.chunk_threshold = chunk
    if compression:
        writer.set_compression(Rosbag1Writer.CompressionFormat[compression])
    with writer:
        senders = {
            name: writer.add_connection(name, kind, typestore=NOETIC)
            for name, kind in TYPES.items()
        }
        for log, name, message in written:
            payload = NOETIC.serialize_ros1(to_ros1(message), TYPES[name])
            writer.write(senders[name], log, payload)
    return path


def write_rosbag2(
    folder: Path, written: list[Written], storage: str, *, version=9, compression="NONE"
) -> Path:
    """Write a rosbag2 folder with the writer of `rosbags`."""
    writer = Rosbag2Writer(folder, version=version, storage_plugin=StoragePlugin[storage])
    writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    with writer:
        senders = {
            name: writer.add_connection(name, kind, typestore=typestore())
            for name, kind in TYPES.items()
        }
        for log, name, message in written:
            writer.write(senders[name], log, serialize(message))
    return folder


def write_mcap(
    path: Path,
    written: list[Written],
    *,
    compression=CompressionType.NONE,
    chunk=1 << 20,
    chunked=True,
    indexed=True,
    schema=lambda kind: ("ros2msg", definition(kind)),
) -> Path:
    """Write an MCAP file with the writer of `mcap`; `indexed` False leaves all indexes out."""
    options = {} if indexed else {"index_types": IndexType.NONE}
    if not indexed:
        options |= {"use_statistics": False, "repeat_channels": False, "repeat_schemas": False}
    with path.open("wb") as file:
        writer = McapWriter(
            file, chunk_size=chunk, compression=compression, use_chunking=chunked, **options
        )
        writer.start(profile="ros2")
        senders = {}
        for name, kind in TYPES.items():
            encoding, text = schema(kind)
            number = writer.register_schema(kind, encoding, text.encode())
            senders[name] = writer.register_channel(name, "cdr", number)
        for log, name, message in written:
            writer.add_message(senders[name], log, serialize(message), log)
        writer.finish()
    return path


def clock_messages(logs: list[int]) -> list[Written]:
    """Return a clock message for each log time [ns]; each carries its own number."""
    kind = message_class(TYPES["/clock"])
    return [Written(log, "/clock", kind(time_of(i))) for i, log in enumerate(logs)]


WRITERS = {
    **{
        f"{storage}, version {version}, compressed {mode}": (
            lambda path, written, s=storage, v=version, m=mode: write_rosbag2(
                path, written, s, version=v, compression=m
            )
        )
        for storage in ("MCAP", "SQLITE3")
        for version in (8, 9)
        for mode in ("NONE", "MESSAGE", "FILE")
    },
    "MCAP, one compressed chunk": lambda path, written: write_rosbag2(
        path, written, "MCAP", compression="STORAGE"
    ),
    **{
        f"mcap {kind.name}": lambda path, written, kind=kind: write_mcap(
            path, written, compression=kind, chunk=SMALL
        )
        for kind in CompressionType
    },
    "mcap without chunks": lambda path, written: write_mcap(path, written, chunked=False),
    "mcap without index": lambda path, written: write_mcap(
        path, written, indexed=False, chunk=SMALL
    ),
    **{
        f"ROS 1 {kind}": lambda path, written, kind=kind: write_rosbag1(
            path, written, compression=kind, chunk=SMALL
        )
        for kind in (None, "LZ4", "BZ2")
    },
}


def stream(path: Path, *args, **kwargs) -> list[BagMessage]:
    """Return all messages of a bag that are asked for."""
    with open_bag(path) as bag:
        return list(bag.messages(*args, **kwargs))


def expected(written: list[Written]) -> list[BagMessage]:
    """Return what the stream of a bag with these messages must be."""
    return [
        BagMessage(log, topic, serialize(message)) for log, topic, message in in_log_order(written)
    ]


def assert_same(one, other):
    """Compare field by field, numbers by their bits."""
    if hasattr(one, "__msgtype__"):
        assert one.__msgtype__ == other.__msgtype__
        for name in one.__dataclass_fields__:
            assert_same(getattr(one, name), getattr(other, name))
    elif isinstance(one, list):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            assert_same(mine, theirs)
    else:
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes()
