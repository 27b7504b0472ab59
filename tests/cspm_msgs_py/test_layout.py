"""Fixed layouts against the serialiser of `rosbags`, message by message."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import ROW_TOPICS
from rosbags.typesys import Stores, get_typestore

from cspm_msgs_py.diagnostics import (
    Level,
    Status,
    decode_diagnostics,
    encode_diagnostics,
    hardware_id_of,
)
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.message import carries_row, message_of, topic_of
from cspm_msgs_py.ros_types import check_definition, definition, deserialize, serialize, type_hash
from cspm_msgs_py.topics import POSE, Topic, contract_topics

STORE = get_typestore(Stores.ROS2_JAZZY)
VECTOR, QUATERNION = ("x", "y", "z"), ("x", "y", "z", "w")

names = st.lists(
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9),
    min_size=1,
    max_size=5,
    unique=True,
)
stamps = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)


@st.composite
def topics_of_any_cables(draw):
    topics = contract_topics(draw(names), has_bar=True, has_winch_frame=True)
    topics.pop("/diagnostics")
    return topics[draw(st.sampled_from(sorted(topics)))]


def rows_for(topic, count):
    bits = st.integers(0, 2**64 - 1).map(lambda i: struct.unpack("<d", struct.pack("<Q", i))[0])
    return st.lists(
        st.lists(bits, min_size=topic.width, max_size=topic.width), min_size=count, max_size=count
    )


@settings(deadline=None)
@given(data=st.data(), topic=topics_of_any_cables())
def test_encode_is_what_the_serialiser_writes_and_decode_its_inverse(data, topic):
    times = np.array(data.draw(st.lists(stamps, max_size=4)), dtype=np.int64)
    rows = np.array(data.draw(rows_for(topic, len(times)))).reshape(len(times), topic.width)
    layout = layout_of(topic)
    encoded = layout.encode(times, rows)
    for payload, time, row in zip(encoded, times.tolist(), rows, strict=True):
        message = message_of(topic, time, row)
        assert payload.tobytes() == bytes(STORE.serialize_cdr(message, topic.ros_type))
    found_times, found_rows = layout.decode(encoded)
    np.testing.assert_array_equal(found_times, times)
    np.testing.assert_array_equal(found_rows.view(np.int64), rows.view(np.int64))


def leaves(message):
    """The numbers of a message in the order that its topic's columns promise."""
    kind = type(message).__name__.split("__")[-1]
    if kind == "PoseStamped":
        pose = message.pose
        return [getattr(pose.position, k) for k in VECTOR] + [
            getattr(pose.orientation, k) for k in QUATERNION
        ]
    if kind == "TwistStamped":
        return [getattr(part, k) for part in _twist(message.twist) for k in VECTOR]
    if kind == "WrenchStamped":
        parts = (message.wrench.force, message.wrench.torque)
        return [getattr(part, k) for part in parts for k in VECTOR]
    if kind == "JointState":
        return [*message.position, *message.velocity, *message.effort]
    point = message.points[0]
    found = [getattr(point.transforms[0].translation, k) for k in VECTOR]
    found += [getattr(point.transforms[0].rotation, k) for k in QUATERNION]
    for twist in (point.velocities[0], point.accelerations[0]):
        found += [getattr(part, k) for part in _twist(twist) for k in VECTOR]
    return found


def _twist(twist):
    return twist.linear, twist.angular


@pytest.mark.parametrize("topic", ROW_TOPICS.values(), ids=lambda topic: topic.name)
def test_fields_stand_where_their_columns_say(topic):
    row = np.arange(topic.width) + 1.5
    stamp = 12 * 10**9 + 34
    payload = layout_of(topic).encode([stamp], [row])[0].tobytes()
    message = STORE.deserialize_cdr(payload, topic.ros_type)
    if topic.ros_type == "rosgraph_msgs/msg/Clock":
        assert (message.clock.sec, message.clock.nanosec) == (12, 34)
        return
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (12, 34)
    assert message.header.frame_id == topic.frame_id
    assert leaves(message) == row.tolist()
    if topic.ros_type == "sensor_msgs/msg/JointState":
        assert tuple(message.name) == topic.joint_names
        filled = [
            part for part in ("position", "velocity", "effort") if len(getattr(message, part))
        ]
        assert tuple(filled) == topic.parts
    if topic.ros_type == "trajectory_msgs/msg/MultiDOFJointTrajectory":
        start = message.points[0].time_from_start
        assert (tuple(message.joint_names), start.sec, start.nanosec) == (topic.joint_names, 0, 0)


@pytest.mark.parametrize("topic", ROW_TOPICS.values(), ids=lambda topic: topic.name)
def test_a_topic_is_known_again_from_its_message(topic):
    assert topic_of(topic.name, message_of(topic, 5, np.zeros(topic.width))) == topic


def test_matches_looks_at_names_and_frame_but_not_at_numbers_or_padding():
    layout = layout_of(ROW_TOPICS["/bar/pose"])
    payload = layout.encode([1, 2], np.ones((2, 7)))
    assert layout.matches(payload).tolist() == [True, True]
    frame_end = payload[0].tobytes().index(b"world_ned\0") + len(b"world_ned\0")
    padded, renamed = payload.copy(), payload.copy()
    padded[1, frame_end : frame_end + 2] = 0xAB
    assert frame_end + 2 == layout.runs[0][0]
    renamed[1, frame_end - 2] += 1
    assert layout.matches(padded).tolist() == [True, True]
    assert layout.matches(renamed).tolist() == [True, False]


def test_stamps_before_the_epoch_round_down():
    layout = layout_of(ROW_TOPICS["/clock"])
    message = STORE.deserialize_cdr(
        layout.encode([-1], np.zeros((1, 0)))[0].tobytes(), "rosgraph_msgs/msg/Clock"
    )
    assert (message.clock.sec, message.clock.nanosec) == (-1, 999_999_999)


@pytest.mark.parametrize("stamp", [2**31 * 10**9, -(2**31) * 10**9 - 1])
def test_stamp_beyond_int32_seconds_is_refused(stamp):
    with pytest.raises(InputError, match=rf"^/clock: stamp {stamp} ns, allowed: ±2147483647 s"):
        layout_of(ROW_TOPICS["/clock"]).encode([0, stamp], np.zeros((2, 0)))


@pytest.mark.parametrize(
    ("times", "rows"), [(2, (2, 6)), (3, (2, 7)), (1, (7,))], ids=["width", "count", "flat"]
)
def test_shapes_that_do_not_fit_are_refused(times, rows):
    with pytest.raises(InputError, match=r"^/bar/pose: .* allowed: \(n,\) and \(n, 7\)$"):
        layout_of(ROW_TOPICS["/bar/pose"]).encode(np.zeros(times, dtype=int), np.zeros(rows))


def test_types_without_a_row_are_refused():
    assert carries_row("sensor_msgs/msg/JointState")
    assert not carries_row("std_msgs/msg/String")
    topic = Topic("/words", "std_msgs/msg/String", "", ())
    with pytest.raises(InputError, match=r"^/words: std_msgs/msg/String carries no row of numbers"):
        layout_of(topic)
    message = STORE.types["std_msgs/msg/String"]("x")
    with pytest.raises(InputError, match=r"^/words: std_msgs/msg/String carries no row of numbers"):
        topic_of("/words", message)


def test_columns_that_do_not_fit_the_joints_are_refused():
    topic = Topic("/q", "sensor_msgs/msg/JointState", "", ("a", "b", "c"), ("j",), ("effort",))
    with pytest.raises(InputError, match=r"^/q: 3 columns for 1 parts of 1 joints, allowed: 1$"):
        layout_of(topic)


def test_messages_that_are_no_row_are_refused():
    joints = message_of(ROW_TOPICS["/winches/state"], 0, np.zeros(9))
    joints.velocity = np.zeros(2)
    with pytest.raises(
        InputError, match=r"^/w: velocity has 2 values for 3 names, allowed: one each$"
    ):
        topic_of("/w", joints)
    reference = message_of(ROW_TOPICS["/bar/reference"], 0, np.zeros(19))
    reference.points *= 2
    with pytest.raises(InputError, match=r"^/r: a trajectory of 2 points, allowed: one point"):
        topic_of("/r", reference)


text = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12)
findings = st.builds(
    Status,
    st.sampled_from([int(v) for v in Level]),
    text,
    text,
    st.dictionaries(text, text, max_size=3),
)


@settings(deadline=None)
@given(stamp=stamps, statuses=st.lists(findings, max_size=3))
def test_diagnostics_come_back(stamp, statuses):
    payload = encode_diagnostics(stamp, statuses)
    found = decode_diagnostics(payload)
    assert found.stamp_ns == stamp
    assert found.statuses == statuses
    message = STORE.deserialize_cdr(payload, "diagnostic_msgs/msg/DiagnosticArray")
    assert [s.name for s in message.status] == [s.name for s in statuses]


def test_bytes_that_are_no_message_are_refused():
    with pytest.raises(
        InputError, match=r"^3 bytes that are no diagnostic_msgs/msg/DiagnosticArray"
    ):
        decode_diagnostics(b"\0\1\0")
    with pytest.raises(
        InputError, match=r"^message type 'a/msg/B' is unknown, allowed: the common"
    ):
        deserialize(b"", "a/msg/B")


def test_definitions_and_hashes_are_those_of_the_ros_distribution():
    assert type_hash("std_msgs/msg/String") == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    text = definition("geometry_msgs/msg/PoseStamped")
    assert text.startswith("std_msgs/Header header\ngeometry_msgs/Pose pose\n")
    assert f"{'=' * 80}\nMSG: geometry_msgs/Quaternion\n" in text


def test_only_definitions_with_the_same_fields_are_accepted():
    kind = "geometry_msgs/msg/PoseStamped"
    text = definition(kind)
    check_definition(kind, "ros2msg", "# a comment\n" + text)
    with pytest.raises(InputError, match=r"Quaternion has other fields than in ROS 2 Jazzy$"):
        check_definition(kind, "ros2msg", text.replace("float64 w", "float32 w"))
    with pytest.raises(InputError, match=r"has the encoding 'protobuf', allowed: ros2msg$"):
        check_definition(kind, "protobuf", text)
    with pytest.raises(InputError, match=r"^schema of .* is not a message definition$"):
        check_definition(kind, "ros2msg", "}{")


def test_a_pose_topic_serialises_equally_through_both_roads():
    topic = Topic("/p", "geometry_msgs/msg/PoseStamped", "x_ned", POSE)
    row = np.arange(7.0)
    assert layout_of(topic).encode([3], [row])[0].tobytes() == serialize(message_of(topic, 3, row))


def test_diagnostics_name_the_machine():
    status = Status(Level.OK, "plant", "ok", {"a": "b"})
    payload = encode_diagnostics(7, [status], "thesis")
    assert hardware_id_of(payload) == "thesis"
    assert decode_diagnostics(payload).statuses == [status]
    assert hardware_id_of(encode_diagnostics(7, [status])) == ""
    assert hardware_id_of(encode_diagnostics(7, [], "thesis")) == ""
