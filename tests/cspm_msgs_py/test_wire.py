"""One message at a time, against the block encoder, `rosbags` and, where there is ROS, rclpy."""

import importlib
import struct
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from recording_samples import CABLES, ROW_TOPICS
from rosbags.typesys import Stores, get_typestore

from cspm_msgs_py import wire
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros_types import message_class, serialize
from cspm_msgs_py.topics import CLOCK, DIAGNOSTICS, contract_topics
from cspm_msgs_py.wire import WireReader, WireWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
STAMP = 12 * 10**9 + 34
TENSION, STATE = ROW_TOPICS["/cables/tension"], ROW_TOPICS["/winches/state"]
POSE, REFERENCE = ROW_TOPICS["/bar/pose"], ROW_TOPICS["/bar/reference"]
ORDER = r"'hoist_1', 'surge_1', 'sway_1' in this order"
ONE_POINT = "one point with one transform, velocity and acceleration"

each_topic = pytest.mark.parametrize("topic", ROW_TOPICS.values(), ids=lambda topic: topic.name)
any_topic = st.sampled_from(list(ROW_TOPICS.values()))
any_stamp = st.integers(0, 2**31 * 10**9 - 1)
any_float = st.integers(0, 2**64 - 1).map(lambda i: struct.unpack("<d", struct.pack("<Q", i))[0])
cable_names = st.lists(
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9),
    min_size=1,
    max_size=5,
    unique=True,
)


@st.composite
def topics_of_any_cables(draw):
    topics = contract_topics(draw(cable_names), has_bar=True, has_winch_frame=True)
    topics.pop(DIAGNOSTICS.name)
    return topics[draw(st.sampled_from(sorted(topics)))]


def with_quaternion(topic, row, quaternion):
    """The row with its attitude replaced where the topic has one."""
    row = np.array(row, dtype=float)
    if "qx" in topic.fields:
        start = topic.fields.index("qx")
        row[start : start + 4] = quaternion
    return row


def row_for(topic, seed=0):
    rng = np.random.default_rng([seed, *topic.name.encode()])
    quaternion = rng.normal(size=4)
    row = rng.normal(size=topic.width) * 10.0 ** rng.integers(-9, 9, topic.width)
    return with_quaternion(topic, row, quaternion / np.linalg.norm(quaternion))


def message_for(topic, row=None, stamp=STAMP):
    return message_of(topic, stamp, row_for(topic) if row is None else row)


def payload_for(topic, row=None, stamp=STAMP):
    return serialize(message_for(topic, row, stamp))


def uninitialised(payload, topic, seed, extra):
    """The payload with noise in its padding and `extra` bytes of noise at the end."""
    noise = np.random.default_rng(seed).integers(0, 256, len(payload) + extra, dtype=np.uint8)
    layout, found = layout_of(topic), noise.copy()
    found[: len(payload)] = np.frombuffer(payload, dtype=np.uint8)
    padding = np.ones(layout.size, dtype=bool)
    padding[layout.constant] = False
    padding[layout.seconds : layout.seconds + 8] = False
    for offset, count in layout.runs:
        padding[offset : offset + 8 * count] = False
    found[: layout.size][padding] = noise[: layout.size][padding]
    return found.tobytes()


@pytest.fixture
def fast_only(monkeypatch):
    """Call it to forbid the typed reader from then on."""

    def never(payload, ros_type):
        raise AssertionError("typed reader used")

    return lambda: monkeypatch.setattr(wire, "deserialize", never)


# --- what is written, and read back ---


@given(data=st.data(), topic=topics_of_any_cables())
def test_a_message_is_what_the_block_encoder_writes(data, topic):
    writer = WireWriter(topic)
    stamps = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)
    for _ in range(2):
        stamp = data.draw(stamps)
        row = np.array([data.draw(any_float) for _ in topic.fields])
        assert writer.encode(stamp, row) == layout_of(topic).encode([stamp], [row])[0].tobytes()


@given(data=st.data(), topic=topics_of_any_cables(), stamp=any_stamp)
def test_a_written_message_comes_back(data, topic, stamp):
    finite = st.floats(allow_nan=False, allow_infinity=False)
    row = np.array([data.draw(finite) for _ in topic.fields])
    row = with_quaternion(topic, row, [0.5, -0.5, 0.5, -0.5])
    found_stamp, found = WireReader(topic).decode(WireWriter(topic).encode(stamp, row))
    assert found_stamp == stamp
    np.testing.assert_array_equal(found.view(np.int64), row.view(np.int64))


@each_topic
def test_rows_and_bytes_belong_to_the_caller(topic):
    writer, reader = WireWriter(topic), WireReader(topic)
    first = writer.encode(1, row_for(topic, 1))
    kept = bytes(bytearray(first))
    second = writer.encode(2, row_for(topic, 2))
    assert isinstance(first, bytes)
    assert first == kept != second
    _, row = reader.decode(first)
    row[:] = 0.0
    np.testing.assert_array_equal(reader.decode(first)[1], row_for(topic, 1))


@pytest.mark.parametrize("stamp", [2**31 * 10**9, -(2**31) * 10**9 - 1, 10**40])
def test_stamp_beyond_int32_seconds_is_not_written(stamp):
    with pytest.raises(InputError, match=rf"^/clock: stamp {stamp} ns, allowed: ±2147483647 s"):
        WireWriter(CLOCK).encode(stamp, np.zeros(0))


@pytest.mark.parametrize("shape", [(2,), (4,), (1,), (1, 3), ()])
def test_row_of_another_shape_is_not_written(shape):
    with pytest.raises(InputError) as caught:
        WireWriter(TENSION).encode(0, np.zeros(shape))
    assert str(caught.value) == f"/cables/tension: a row of shape {shape}, allowed: (3,)"


@pytest.mark.parametrize("kind", [WireWriter, WireReader])
def test_topics_without_a_row_have_no_wire(kind):
    with pytest.raises(InputError, match=r"^/diagnostics: .* carries no row of numbers, allowed:"):
        kind(DIAGNOSTICS)


# --- other senders ---


@each_topic
@pytest.mark.parametrize("extra", range(9))
def test_padding_and_appended_bytes_are_not_looked_at(topic, extra, fast_only):
    reader = WireReader(topic)
    fast_only()
    stamp, row = reader.decode(uninitialised(payload_for(topic), topic, extra, extra))
    assert stamp == STAMP
    np.testing.assert_array_equal(row, row_for(topic))


@each_topic
def test_more_than_eight_appended_bytes_are_refused(topic):
    other, _, _ = from_another_sender(topic)
    for payload in (payload_for(topic), serialize(other)):
        for extra in (9, 10, 11):
            text = refusal(topic, payload + bytes(extra))
            assert text == f"{extra} bytes after the message, allowed: at most 8"
        assert "bytes that are no" in refusal(topic, payload + bytes(12))


def from_another_sender(topic, seed=0, frame="map"):
    """A message with every part of a JointState filled; its stamp and row.

    And with another frame, where that has no meaning.
    """
    message = message_for(topic, row_for(topic, seed), STAMP + seed)
    if topic is not CLOCK:
        message.header.frame_id = topic.frame_id or frame
    for part in ("position", "velocity", "effort"):
        if hasattr(message, part) and not len(getattr(message, part)):
            setattr(message, part, np.full(len(topic.joint_names), np.nan))
    return message, STAMP + seed, row_for(topic, seed)


@each_topic
def test_another_sender_is_read_and_from_its_second_message_on_read_fast(topic, fast_only):
    reader = WireReader(topic)
    for seed in range(5):
        message, stamp, row = from_another_sender(topic, seed)
        found_stamp, found = reader.decode(serialize(message))
        assert found_stamp == stamp
        np.testing.assert_array_equal(found, row)
        fast_only()
    for seed in range(3):
        np.testing.assert_array_equal(
            reader.decode(payload_for(topic, row_for(topic, seed)))[1], row_for(topic, seed)
        )


@each_topic
def test_big_endian_is_read(topic):
    message, stamp, row = from_another_sender(topic)
    payload = bytes(STORE.serialize_cdr(message, topic.ros_type, little_endian=False))
    reader = WireReader(topic)
    for _ in range(3):
        found_stamp, found = reader.decode(payload)
        assert found_stamp == stamp
        np.testing.assert_array_equal(found, row)


def test_senders_without_end_are_read_and_few_are_remembered(monkeypatch):
    learned = []
    find = wire.find_layout
    monkeypatch.setattr(wire, "find_layout", lambda topic: learned.append(topic) or find(topic))
    reader, kept = WireReader(TENSION), layout_of.cache_info().currsize
    for seed in range(40):
        message, _, row = from_another_sender(TENSION, seed, frame=f"frame_{seed % 20}")
        np.testing.assert_array_equal(reader.decode(serialize(message))[1], row)
    assert [topic.frame_id for topic in learned] == [f"frame_{i}" for i in range(8)]
    assert layout_of.cache_info().currsize == kept


# --- what is refused, and how ---


def refusal(topic, payload):
    with pytest.raises(InputError) as caught:
        WireReader(topic).decode(payload)
    text = str(caught.value)
    assert text.isprintable()
    assert text.startswith(f"{topic.name}: ")
    assert len(text) < 300
    return text.removeprefix(f"{topic.name}: ")


def changed(topic, **fields):
    message = message_for(topic)
    for name, value in fields.items():
        setattr(message, name, value)
    return serialize(message)


MANY = [f"cable_{i}" for i in range(25)]


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"name": []}, f"0 names, allowed: {ORDER}"),
        ({"name": CABLES[:2]}, f"2 names, allowed: {ORDER}"),
        ({"name": MANY, "effort": np.zeros(25)}, f"25 names, allowed: {ORDER}"),
        (
            {"name": ["hoist_1", "sway_1", "surge_1"]},
            f"names in a wrong order, name 2 is 'sway_1', allowed: {ORDER}",
        ),
        ({"name": ["a\n\x1b", *CABLES[1:]]}, rf"name 1 is 'a\n\x1b', allowed: {ORDER}"),
        ({"name": [*CABLES[:2], "z" * 999]}, f"name 3 is '{'z' * 40}'…, allowed: {ORDER}"),
        ({"name": CABLES[:2] + CABLES[:1]}, f"name 3 is 'hoist_1', allowed: {ORDER}"),
        ({"effort": np.zeros(0)}, "effort is empty, allowed: one value for each of 3 names"),
        ({"effort": np.zeros(2)}, "effort has 2 values for 3 names, allowed: one each"),
        ({"velocity": np.zeros(9)}, "velocity has 9 values for 3 names, allowed: one each"),
    ],
)
def test_joints_that_are_not_the_contracts_are_refused(fields, text):
    assert refusal(TENSION, changed(TENSION, **fields)) == text


def test_missing_part_of_several_is_named():
    text = refusal(STATE, changed(STATE, velocity=np.zeros(0)))
    assert text == "velocity is empty, allowed: one value for each of 3 names"


def test_ten_thousand_elements_are_refused_by_their_size():
    names = [f"c{i}" for i in range(10_000)]
    payload = changed(TENSION, name=names, effort=np.zeros(10_000))
    assert refusal(TENSION, payload) == (
        f"a message of {len(payload)} bytes, allowed: at most"
        f" {4 * layout_of(TENSION).size + 2048} (it carries 3 numbers)"
    )


def test_a_long_list_of_allowed_names_is_cut():
    topic = contract_topics(MANY, has_bar=False, has_winch_frame=False)["/cables/tension"]
    text = refusal(topic, changed(topic, name=MANY[:24]))
    assert text == (
        f"24 names, allowed: {', '.join(map(repr, MANY[:12]))}, … (25 names) in this order"
    )


def test_frame_of_any_sensible_length_is_read():
    longest, _, row = from_another_sender(TENSION, frame="é" * 255)
    np.testing.assert_array_equal(WireReader(TENSION).decode(serialize(longest))[1], row)
    longer, _, _ = from_another_sender(TENSION, frame="e" * 256)
    assert refusal(TENSION, serialize(longer)) == (
        "a frame_id of 256 characters, allowed: at most 255"
    )


@each_topic
@pytest.mark.parametrize("frame", ["map", "", "world", "World_ned"])
def test_vectors_in_another_frame_are_refused(topic, frame):
    if not topic.frame_id:
        return
    message = message_for(topic, row_for(topic))
    message.header.frame_id = frame
    assert refusal(topic, serialize(message)) == (
        f"frame {frame!r}, allowed: {topic.frame_id!r} (z down)"
    )


def with_point(**fields):
    message = message_for(REFERENCE)
    for name, value in fields.items():
        setattr(message.points[0], name, value)
    return serialize(message)


def test_references_that_are_not_one_instant_are_refused():
    message = message_for(REFERENCE)
    transforms, points = message.points[0].transforms, message.points
    duration = message_class("builtin_interfaces/msg/Duration")
    cases = {
        changed(REFERENCE, points=[]): f"a trajectory of 0 points, allowed: {ONE_POINT}",
        changed(REFERENCE, points=points * 2): f"a trajectory of 2 points, allowed: {ONE_POINT}",
        changed(REFERENCE, joint_names=["ship"]): (
            "name 1 is 'ship', allowed: 'bar_ned' in this order"
        ),
        with_point(transforms=transforms * 2): (f"a point with 2 transforms, allowed: {ONE_POINT}"),
        with_point(velocities=[]): f"a point with 0 velocities, allowed: {ONE_POINT}",
        with_point(accelerations=[]): f"a point with 0 accelerations, allowed: {ONE_POINT}",
        with_point(time_from_start=duration(0, 1)): (
            "time_from_start 0 s and 1 ns, allowed: 0 (the header's stamp is the instant)"
        ),
        with_point(time_from_start=duration(-1, 5)): (
            "time_from_start -1 s and 5 ns, allowed: 0 (the header's stamp is the instant)"
        ),
    }
    assert {payload: refusal(REFERENCE, payload) for payload in cases} == cases


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_refused(value):
    row = row_for(TENSION)
    row[1] = value
    assert refusal(TENSION, payload_for(TENSION, row)) == (
        f"effort of surge_1 is {value}, allowed: finite numbers"
    )
    row = row_for(REFERENCE)
    row[-1] = value
    assert refusal(REFERENCE, payload_for(REFERENCE, row)) == (
        f"alphaz is {value}, allowed: finite numbers"
    )


@pytest.mark.parametrize("row", [[np.inf, -np.inf, 0.0], [1e308, 1e308, np.nan]])
def test_sums_that_hide_a_number_that_is_not_finite_are_looked_through(row):
    text = refusal(TENSION, payload_for(TENSION, np.array(row)))
    assert text.endswith("allowed: finite numbers")


def test_finite_numbers_whose_sum_is_not_are_read():
    row = np.full(3, 1.7e308)
    np.testing.assert_array_equal(WireReader(TENSION).decode(payload_for(TENSION, row))[1], row)


@pytest.mark.parametrize("name", ["/bar/pose", "/bar/reference", "/truth/winch_frame/pose"])
@pytest.mark.parametrize("length", [0.0, 0.9989, 1.0011, 1e200])
def test_quaternion_that_is_no_rotation_is_refused(name, length):
    topic = ROW_TOPICS[name]
    row = with_quaternion(topic, row_for(topic), [0.6 * length, 0.0, 0.8 * length, 0.0])
    assert refusal(topic, payload_for(topic, row)) == (
        f"a quaternion of length {length:.6g}, allowed: 1 within 0.001"
    )


@pytest.mark.parametrize("length", [0.9991, 1.0009])
def test_quaternion_of_about_unit_length_is_read(length):
    row = with_quaternion(POSE, row_for(POSE), [0.0, 0.6 * length, 0.0, -0.8 * length])
    np.testing.assert_array_equal(WireReader(POSE).decode(payload_for(POSE, row))[1], row)


@each_topic
@pytest.mark.parametrize(("seconds", "nanoseconds"), [(-1, 0), (-1, 999_999_999), (0, 10**9)])
def test_stamps_that_are_none_are_refused(topic, seconds, nanoseconds):
    payload = bytearray(payload_for(topic))
    struct.pack_into("<iI", payload, layout_of(topic).seconds, seconds, nanoseconds)
    assert refusal(topic, bytes(payload)) == (
        f"stamp of {seconds} s and {nanoseconds} ns, allowed: 0 s and more, 0 to 999999999 ns"
    )


@each_topic
def test_messages_of_other_types_are_refused(topic):
    """But for those whose bytes are equal: names of types are not in the bytes."""
    kinds = {other.ros_type: other for other in ROW_TOPICS.values()}
    twist, wrench = "geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/WrenchStamped"
    # A pose has 8 bytes more than a twist, as if a serialiser had appended them.
    equal = {twist, wrench, POSE.ros_type} if topic.ros_type in (twist, wrench) else set()
    for kind, other in kinds.items():
        if kind not in equal | {topic.ros_type}:
            refusal(topic, payload_for(other))


# --- hostile bytes ---


def numbers_in(topic, message):
    """The topic's numbers in a typed message, found by walking its fields."""
    if topic is CLOCK:
        return []
    if topic.parts:
        return [value for part in topic.parts for value in getattr(message, part)]
    if topic.joint_names:
        point = message.points[0]
        return [*walked(point.transforms), *walked(point.velocities), *walked(point.accelerations)]
    return list(walked(message))


def walked(item):
    """All floats below an item, in the order of the definition."""
    if isinstance(item, float):
        yield item
    elif isinstance(item, list):
        for element in item:
            yield from walked(element)
    elif hasattr(item, "__dataclass_fields__"):
        for name in item.__dataclass_fields__:
            yield from walked(getattr(item, name))


def decoded(reader, payload):
    """Stamp, row and no text, or the text of the refusal."""
    try:
        return *reader.decode(payload), ""
    except InputError as err:
        return None, None, str(err)


def read_or_refused(topic, payload):
    """Hold what must be true of any bytes: one line, or what a typed reader finds."""
    stamp, row, text = decoded(WireReader(topic), payload)
    if text:
        assert text.startswith(f"{topic.name}: ")
        assert "allowed: " in text
        assert text.isprintable()
        return
    for extra in (0, 4, 8):
        try:
            message = STORE.deserialize_cdr(payload[: len(payload) - extra], topic.ros_type)
            break
        except Exception:
            continue
    else:
        raise AssertionError("read what a typed reader refuses")
    time = message.clock if topic is CLOCK else message.header.stamp
    assert stamp == time.sec * 10**9 + time.nanosec
    assert row.tolist() == numbers_in(topic, message)
    assert np.isfinite(row).all()


@given(topic=any_topic, payload=st.binary(max_size=400))
@example(topic=CLOCK, payload=b"")
def test_random_bytes(topic, payload):
    read_or_refused(topic, payload)
    read_or_refused(topic, b"\0\1\0\0" + payload)
    read_or_refused(topic, b"\0\0\0\0" + payload)


@each_topic
def test_every_truncation(topic):
    payload = payload_for(topic)
    for size in range(len(payload)):
        refusal(topic, payload[:size])


@given(data=st.data(), topic=any_topic)
def test_flipped_bits(data, topic):
    payload = bytearray(payload_for(topic))
    places = st.lists(st.integers(0, 8 * len(payload) - 1), min_size=1, max_size=4)
    for bit in data.draw(places):
        payload[bit // 8] ^= 1 << bit % 8
    read_or_refused(topic, bytes(payload))


@given(
    first=any_topic,
    second=any_topic,
    reader=any_topic,
    cut=st.integers(0, 400),
    extra=st.binary(max_size=20),
)
def test_concatenations(first, second, reader, cut, extra):
    read_or_refused(reader, payload_for(first)[:cut] + payload_for(second) + extra)
    read_or_refused(reader, payload_for(reader) + extra)


@each_topic
def test_any_field_announcing_four_billion_costs_no_memory(topic):
    payload = payload_for(topic)
    reader = WireReader(topic)
    tracemalloc.start()
    try:
        for offset in range(4, len(payload) - 3, 4):
            for count in (2**32 - 1, 2**31 - 1, 2**29, 10**6):
                broken = bytearray(payload)
                struct.pack_into("<I", broken, offset, count)
                text = decoded(reader, bytes(broken))[2]
                assert not text or text.startswith(f"{topic.name}: ")
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


def test_the_longest_message_that_is_looked_into_is_bounded(fast_only):
    payload = payload_for(POSE)
    most = 4 * len(payload) + 2048
    assert refusal(POSE, payload + bytes(most - len(payload))) == (
        f"{most} bytes that are no geometry_msgs/msg/PoseStamped, allowed: the CDR bytes of one"
    )
    fast_only()
    assert refusal(POSE, payload + bytes(most - len(payload) + 1)).startswith(
        f"a message of {most + 1} bytes, allowed: at most {most} "
    )


# --- the serialiser of ROS ---


@pytest.fixture(scope="module")
def ros():
    """The module `rclpy.serialization`, with the support of one type loaded."""
    with warnings.catch_warnings():
        # The parser that rclpy loads with its first type uses a module deprecated in 3.11.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            module = importlib.import_module("rclpy.serialization")
            module.serialize_message(ros_class(CLOCK.ros_type)())
        except ImportError as err:
            pytest.skip(f"rclpy cannot be imported: {err}")
    return module


def ros_class(ros_type):
    package, _, kind = ros_type.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


def as_ros(item):
    """The same message, list or value in the classes of ROS."""
    if isinstance(item, np.ndarray):
        return item.tolist()
    if isinstance(item, list):
        return [as_ros(element) for element in item]
    if not hasattr(item, "__msgtype__"):
        return item
    names = [name for name in item.__dataclass_fields__ if name != "__msgtype__"]
    return ros_class(item.__msgtype__)(**{name: as_ros(getattr(item, name)) for name in names})


@each_topic
def test_what_ros_writes_is_read_without_the_typed_reader(topic, ros, fast_only):
    reader = WireReader(topic)
    fast_only()
    for seed in range(20):
        message = as_ros(message_for(topic, row_for(topic, seed), STAMP + seed))
        stamp, row = reader.decode(ros.serialize_message(message))
        assert stamp == STAMP + seed
        np.testing.assert_array_equal(row, row_for(topic, seed))


@each_topic
def test_another_sender_on_ros_is_read(topic, ros, fast_only):
    reader = WireReader(topic)
    for seed in range(20):
        message, stamp, row = from_another_sender(topic, seed)
        found_stamp, found = reader.decode(ros.serialize_message(as_ros(message)))
        assert found_stamp == stamp
        np.testing.assert_array_equal(found, row)
        fast_only()


@each_topic
def test_ros_reads_what_is_written(topic, ros):
    writer = WireWriter(topic)
    for seed in range(5):
        row = row_for(topic, seed)
        found = ros.deserialize_message(writer.encode(STAMP + seed, row), ros_class(topic.ros_type))
        assert found == as_ros(message_for(topic, row, STAMP + seed))


@given(data=st.data(), topic=any_topic)
def test_what_ros_writes_with_flipped_bits(data, topic, ros):
    payload = bytearray(ros.serialize_message(as_ros(message_for(topic))))
    bit = data.draw(st.integers(0, 8 * len(payload) - 1))
    payload[bit // 8] ^= 1 << bit % 8
    assume(len(payload) > 12)
    read_or_refused(topic, bytes(payload))
