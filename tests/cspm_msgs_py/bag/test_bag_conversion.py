"""What of a bag can be played on ROS 2 Jazzy, what becomes of it, and the reason for the rest."""

import sqlite3
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bag_samples import (
    NOETIC,
    START_NS,
    TEXT,
    TYPES,
    assert_same,
    expected,
    sample_messages,
    stream,
    write_mcap,
    write_rosbag2,
)
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import Reader as Rosbag2Reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cspm_msgs_py.bag import open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import time_of
from cspm_msgs_py.ros_types import (
    definition,
    deserialize,
    message_class,
    serialize,
    type_hash,
    typestore,
)

SAMPLES = Path(__file__).resolve().parents[4] / "shared" / "data" / "mcap_samples"
CLOCK = serialize(message_class("rosgraph_msgs/msg/Clock")(time_of(1)))
POSE = "geometry_msgs/msg/PoseStamped"


def test_ros1_messages_become_those_of_ros2_without_the_sequence_number(tmp_path):
    header = NOETIC.types["std_msgs/msg/Header"]
    stamp = NOETIC.types["builtin_interfaces/msg/Time"](2**31 - 1, 999_999_999)
    names = ["hoist_1", "größe", ""]
    numbers = [np.array([1.5, -0.0, np.inf]), np.array([np.nan]), np.zeros(0)]
    message = NOETIC.types["sensor_msgs/msg/JointState"](header(7, stamp, "δ"), names, *numbers)
    path = tmp_path / "joints.bag"
    with Rosbag1Writer(path) as writer:
        sender = writer.add_connection("/winches", message.__msgtype__, typestore=NOETIC)
        writer.write(sender, 3, NOETIC.serialize_ros1(message, message.__msgtype__))
    (found,) = stream(path)
    decoded = deserialize(found.payload, "sensor_msgs/msg/JointState")
    assert (decoded.header.stamp.sec, decoded.header.stamp.nanosec) == (2**31 - 1, 999_999_999)
    assert (decoded.header.frame_id, decoded.name) == ("δ", names)
    for part, values in zip(("position", "velocity", "effort"), numbers, strict=True):
        assert getattr(decoded, part).tobytes() == values.tobytes()
    assert serialize(decoded) == found.payload


ROS1 = {
    "/good": ("std_msgs/msg/String", None),
    "/log": ("rosgraph_msgs/msg/Log", None),
    "/range": ("sensor_msgs/msg/Range", None),
    "/own": ("cspm_msgs/msg/Slack", "float64 share\n"),
    "/altered": ("geometry_msgs/msg/Point", "float32 x\nfloat32 y\nfloat32 z\n"),
    "/header": ("std_msgs/msg/Header", "time stamp\nstring frame_id\n"),
    "/broken": ("std_msgs/msg/Bool", "uint8[ data\n"),
    "/marker": ("visualization_msgs/msg/Marker", None),
}
REASONS = {
    "/log": r"message type 'rosgraph_msgs/msg/Log' is unknown, allowed: the common interfaces",
    "/range": r"sensor_msgs/msg/Range: sensor_msgs/msg/Range has other fields in ROS 2 Jazzy",
    "/own": r"message type 'cspm_msgs/msg/Slack' is unknown, allowed: the common interfaces of ROS",
    "/altered": r"geometry_msgs/msg/Point: geometry_msgs/msg/Point has other fields in ROS 2 Jazzy",
    "/header": r"std_msgs/msg/Header: std_msgs/msg/Header has other fields in ROS 2 Jazzy",
    "/broken": r"schema of std_msgs/msg/Bool is not a message definition",
    "/marker": r"visualization_msgs/msg/Marker: visualization_msgs/msg/Marker has other fields in",
}


def test_ros1_topics_that_cannot_be_played_are_listed_and_the_others_play(tmp_path):
    path = tmp_path / "many.bag"
    with Rosbag1Writer(path) as writer:
        for i, (topic, (kind, text)) in enumerate(ROS1.items()):
            about = {"typestore": NOETIC} if text is None else {"msgdef": text, "md5sum": "0"}
            sender = writer.add_connection(topic, kind, **about)
            writer.write(sender, i, b"\x01\x00\x00\x00a")
    with open_bag(path) as bag:
        assert list(bag.topics) == ["/good"]
        assert bag.unplayable.keys() == REASONS.keys()
        for topic, reason in REASONS.items():
            assert bag.unplayable[topic].startswith(reason)
            assert "\n" not in bag.unplayable[topic]
            with pytest.raises(InputError, match=f"many.bag: {topic} cannot be played: "):
                bag.messages(["/good", topic])
        (found,) = bag.messages()
        assert deserialize(found.payload, "std_msgs/msg/String").data == "a"
        assert (bag.start_ns, bag.end_ns) == (0, len(ROS1) - 1)


def test_a_topic_that_the_bag_does_not_have_is_refused_with_those_it_has(tmp_path):
    path = write_mcap(tmp_path / "bag.mcap", sample_messages(5))
    with open_bag(path) as bag:
        with pytest.raises(
            InputError, match=r"bag\.mcap: no topic /nose, it has: /clock, /bar/pos"
        ):
            bag.messages(["/clock", "/nose"])
        with pytest.raises(InputError, match="no topic clock, it has: /clock"):
            bag.messages(["clock"])


def mcap_of(path, *channels):
    """Write an MCAP file of (topic, type, message encoding, schema encoding, text, payload)."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2")
        for i, (topic, kind, encoding, schema_encoding, text, payload) in enumerate(channels):
            schema = writer.register_schema(kind, schema_encoding, text.encode()) if kind else 0
            writer.add_message(writer.register_channel(topic, encoding, schema), i, payload, i)
        writer.finish()
    return path


def clock_channel(topic="/clock", kind="rosgraph_msgs/msg/Clock", **changes):
    channel = {"encoding": "cdr", "schema": "ros2msg", "text": definition(kind), "payload": CLOCK}
    return (topic, kind, *(channel | changes).values())


def test_mcap_topics_that_cannot_be_played_are_listed(tmp_path):
    other = "builtin_interfaces/Time clock\nstring who\n"
    path = mcap_of(
        tmp_path / "bag.mcap",
        clock_channel(),
        clock_channel("/json", encoding="json", schema="jsonschema", text="{}"),
        clock_channel("/other", text=other),
        clock_channel("/protobuf", schema="protobuf"),
        clock_channel("/unsaid", schema="", text=""),
        ("/untyped", "", "cdr", "", "", CLOCK),
        clock_channel("/two"),
        clock_channel("/two", "std_msgs/msg/Bool"),
        clock_channel("/ros1", encoding="ros1"),
        ("/foreign", "acme_msgs/msg/Thing", "cdr", "ros2msg", "uint8 x\n", CLOCK),
    )
    clock = "rosgraph_msgs/msg/Clock"
    with open_bag(path) as bag:
        assert list(bag.topics) == ["/clock"]
        assert bag.unplayable == {
            "/json": "messages are encoded as 'json', allowed: cdr, ros1",
            "/other": f"schema of {clock}: {clock} has other fields than in ROS 2 Jazzy",
            "/protobuf": f"schema of {clock} has the encoding 'protobuf', allowed: ros2msg",
            "/unsaid": f"{clock} is recorded without its definition",
            "/untyped": "message type 'none' is unknown, allowed: the common interfaces of ROS 2"
            " Jazzy",
            "/two": f"recorded with the types {clock}, std_msgs/msg/Bool, allowed: one",
            "/ros1": f"schema of {clock} has the encoding 'ros2msg', allowed: ros1msg",
            "/foreign": "message type 'acme_msgs/msg/Thing' is unknown, allowed: the common"
            " interfaces of ROS 2 Jazzy",
        }
        assert [message.payload for message in bag.messages()] == [CLOCK]


def test_a_bag_of_which_nothing_can_be_played_says_so(tmp_path):
    path = mcap_of(tmp_path / "bag.mcap", clock_channel("/json", encoding="json"))
    with open_bag(path) as bag:
        assert bag.topics == {}
        with pytest.raises(
            InputError, match=r"bag.mcap: no topic of it can be played, /json: mess"
        ):
            bag.messages()
        with pytest.raises(InputError, match=r"no topic /clock, it has: none$"):
            bag.messages(["/clock"])


IDL = {
    POSE: "std_msgs::msg::Header header; geometry_msgs::msg::Pose pose;",
    "std_msgs/msg/Header": "builtin_interfaces::msg::Time stamp; string frame_id;",
    "builtin_interfaces/msg/Time": "int32 sec; uint32 nanosec;",
    "geometry_msgs/msg/Pose": "geometry_msgs::msg::Point position;"
    " geometry_msgs::msg::Quaternion orientation;",
    "geometry_msgs/msg/Point": "double x; double y; double z;",
    "geometry_msgs/msg/Quaternion": "double x; double y; double z; double w;",
}


def idl(*, separated=True, **changes):
    """Return PoseStamped as rosbag2 writes it in IDL, or as one text."""
    text = ""
    for kind, fields in (IDL | changes).items():
        package, _, name = kind.split("/")
        head = f"{'=' * 80}\nIDL: {kind}\n" if separated else ""
        text += f"{head}module {package} {{ module msg {{ struct {name} {{ {fields} }}; }}; }};\n"
    return text


@pytest.mark.parametrize("separated", [True, False])
def test_definitions_in_idl_are_understood(tmp_path, separated):
    pose = next(m.message for m in sample_messages(100) if m.topic == "/bar/pose")
    text = idl(separated=separated)
    path = mcap_of(tmp_path / "a.mcap", ("/p", POSE, "cdr", "ros2idl", text, serialize(pose)))
    (found,) = stream(path)
    assert_same(deserialize(found.payload, POSE), pose)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            idl(**{"geometry_msgs/msg/Point": "float x; double y; double z;"}),
            "geometry_msgs/msg/Poi",
        ),
        ("module m {", f"schema of {POSE} is not a message definition"),
        (idl(separated=False).splitlines()[1], f"schema of {POSE} defines another type"),
    ],
)
def test_other_definitions_in_idl_are_not_played(tmp_path, text, reason):
    path = mcap_of(tmp_path / "a.mcap", ("/p", POSE, "cdr", "ros2idl", text, b""))
    with open_bag(path) as bag:
        assert reason in bag.unplayable["/p"]


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_big_endian_messages_are_turned(tmp_path, storage):
    written = sample_messages(60)
    writer = Rosbag2Writer(tmp_path / "big", version=9, storage_plugin=StoragePlugin[storage])
    with writer:
        senders = {
            name: writer.add_connection(name, kind, typestore=typestore())
            for name, kind in TYPES.items()
        }
        for log, name, message in written:
            turned = typestore().serialize_cdr(message, TYPES[name], little_endian=False)
            assert bytes(turned) != serialize(message)
            writer.write(senders[name], log, turned)
    assert stream(tmp_path / "big") == expected(written)


@pytest.mark.parametrize("payload", [b"", b"\x00", b"\x00\x03\x00\x00" + CLOCK[4:], CLOCK[:1]])
def test_a_message_that_is_no_cdr_ends_the_stream_with_its_place(tmp_path, payload):
    path = mcap_of(tmp_path / "a.mcap", clock_channel(), clock_channel("/bad", payload=payload))
    with open_bag(path) as bag:
        messages = bag.messages()
        assert next(messages).payload == CLOCK
        text = rf"a.mcap: message of /bad at 1 ns: {len(payload)} bytes that are no rosgraph_msgs/m"
        with pytest.raises(InputError, match=text):
            next(messages)
        assert [message.topic for message in bag.messages(["/clock"])] == ["/clock"]


@pytest.mark.parametrize("payload", [b"", b"\xff\xff\xff\xffa", b"\x00\x00\x00\x00a"])
def test_a_ros1_message_of_another_length_ends_the_stream(tmp_path, payload):
    path = tmp_path / "a.bag"
    with Rosbag1Writer(path) as writer:
        sender = writer.add_connection(TEXT, "std_msgs/msg/String", typestore=NOETIC)
        writer.write(sender, START_NS, payload)
    with pytest.raises(
        InputError, match=f"message of {TEXT} at {START_NS} ns: {len(payload)} byte"
    ):
        stream(path)


MANY_POSES = 2**32 - 1


def test_a_sequence_of_absurd_length_is_refused_at_once(tmp_path):
    kind = "geometry_msgs/msg/PoseArray"
    path = tmp_path / "a.bag"
    with Rosbag1Writer(path) as writer:
        sender = writer.add_connection("/poses", kind, typestore=NOETIC)
        writer.write(sender, 1, bytes(16) + struct.pack("<I", MANY_POSES) + bytes(56))
    with pytest.raises(
        InputError, match=r"of /poses at 1 ns: 76 bytes that are no geometry_msgs/m"
    ):
        stream(path)
    header = bytes(12) + struct.pack(">I", 1) + bytes(4)
    payload = header + struct.pack(">I", MANY_POSES) + bytes(60)
    channel = clock_channel("/poses", kind, payload=payload)
    with pytest.raises(
        InputError, match=r"of /poses at 0 ns: 84 bytes that are no geometry_msgs/m"
    ):
        stream(mcap_of(tmp_path / "a.mcap", channel))


def without_definitions(folder):
    """Make a sqlite3 bag one of rosbag2 before Iron, which keeps no definitions."""
    with sqlite3.connect(folder / f"{folder.name}.db3") as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("UPDATE schema SET schema_version = 3")
    database.close()
    return folder


@pytest.mark.parametrize("compression", ["NONE", "MESSAGE"])
def test_a_bag_without_definitions_is_judged_by_its_messages(tmp_path, compression):
    written = sample_messages(200)
    folder = write_rosbag2(tmp_path / "old", written, "SQLITE3", compression=compression)
    assert stream(without_definitions(folder)) == expected(written)


def test_a_bag_without_definitions_whose_messages_do_not_fit_is_not_played(tmp_path):
    with Rosbag2Writer(tmp_path / "old", version=8) as writer:
        for topic, kind, payload in (
            ("/clock", "rosgraph_msgs/msg/Clock", CLOCK),
            ("/pose", POSE, CLOCK),
            ("/none", POSE, None),
        ):
            sender = writer.add_connection(
                topic, kind, msgdef=definition(kind), rihs01=type_hash(kind)
            )
            if payload:
                writer.write(sender, 1, payload)
    with open_bag(without_definitions(tmp_path / "old")) as bag:
        assert list(bag.topics) == ["/clock", "/none"]
        assert bag.unplayable == {"/pose": f"12 bytes that are no {POSE} (SerdeError)"}
        assert len(list(bag.messages())) == 1


def test_extra_bytes_of_other_serialisers_are_kept(tmp_path):
    path = mcap_of(tmp_path / "a.mcap", clock_channel(payload=CLOCK + bytes(4)))
    assert [message.payload for message in stream(path)] == [CLOCK + bytes(4)]


needs_samples = pytest.mark.skipif(
    not SAMPLES.exists(), reason="the sample recordings are not on this machine"
)


@needs_samples
@pytest.mark.parametrize("inside", ["test_bag_mcap", "test_bag_sqlite3"])
def test_a_real_bag_is_streamed_as_rosbags_reads_it(inside):
    with Rosbag2Reader(SAMPLES / inside) as reader:
        theirs = [
            (log, connection.topic, bytes(payload))
            for connection, log, payload in reader.messages()
            if connection.msgtype != "sensor_msgs/msg/Range"
        ]
    with open_bag(SAMPLES / inside) as bag:
        mine = list(bag.messages())
        # Range got a field in Iron.
        assert list(bag.unplayable) == ["/test/sensor_msgs/range"]
        assert "Range has other fields than in ROS 2 Jazzy" in bag.unplayable.popitem()[1]
        assert len(bag.topics) == 93
    assert sorted(mine) == sorted(theirs)
    assert len(mine) == 186
    assert all(one.log_ns <= other.log_ns for one, other in pairwise(mine))


@needs_samples
def test_a_real_mcap_of_ros1_is_streamed_as_ros2():
    path = SAMPLES / "compressed.mcap"
    with path.open("rb") as file:
        theirs = list(make_reader(file).iter_messages())
    mine = stream(path)
    assert len(mine) == len(theirs) == 826
    recorded = get_typestore(Stores.EMPTY)
    for schema in {schema.id: schema for schema, _, _ in theirs}.values():
        recorded.register(
            get_types_from_msg(schema.data.decode(), schema.name.replace("/", "/msg/"))
        )
    for message, (schema, channel, original) in zip(mine, theirs, strict=True):
        assert (message.log_ns, message.topic) == (original.log_time, channel.topic)
        kind = schema.name.replace("/", "/msg/")
        decoded = deserialize(message.payload, kind)
        assert_same_but_seq(decoded, recorded.deserialize_ros1(original.data, kind))


def assert_same_but_seq(ros2, ros1):
    """Compare the fields that both have, which are all but the header's sequence number."""
    if hasattr(ros2, "__msgtype__"):
        assert ros2.__msgtype__ == ros1.__msgtype__
        extra = ros1.__dataclass_fields__.keys() - ros2.__dataclass_fields__.keys()
        assert extra == ({"seq"} if ros2.__msgtype__ == "std_msgs/msg/Header" else set())
        for name in ros2.__dataclass_fields__:
            assert_same_but_seq(getattr(ros2, name), getattr(ros1, name))
    elif isinstance(ros2, list):
        assert len(ros2) == len(ros1)
        for one, other in zip(ros2, ros1, strict=True):
            assert_same_but_seq(one, other)
    else:
        assert np.asarray(ros2).tobytes() == np.asarray(ros1).tobytes()
