"""Whether two recordings are identical, and where they first are not."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from recording_samples import ROW_TOPICS, STEP_NS, TOPICS, write_sample

from cspm_msgs_py.diagnostics import Level, encode_diagnostics
from cspm_msgs_py.recording import Recording, RecordingWriter, first_difference
from cspm_msgs_py.ros_types import definition
from cspm_msgs_py.topics import WINCH_FRAME, Topic, contract_topics

STEPS = 130


def compare(one, other, **options):
    with Recording(one) as first, Recording(other) as second:
        return first_difference(first, second, **options)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    folder = tmp_path_factory.mktemp("difference") / "a"
    write_sample(folder, STEPS)
    return folder


def test_the_same_run_twice_is_identical(tmp_path, original):
    write_sample(tmp_path / "b", STEPS)
    assert compare(original, tmp_path / "b") is None


def test_other_chunks_make_no_difference(tmp_path, original):
    write_sample(tmp_path / "b", STEPS, block_ns=7_000_000)
    assert compare(original, tmp_path / "b") is None
    assert compare(tmp_path / "b", original) is None


@settings(deadline=None, max_examples=12)
@given(
    name=st.sampled_from([name for name, topic in ROW_TOPICS.items() if topic.width]),
    step=st.integers(0, STEPS - 1),
    block_ns=st.sampled_from([50_000_000, 7_000_000]),
    data=st.data(),
)
def test_one_flipped_bit_is_found_and_named(tmp_path_factory, original, name, step, block_ns, data):
    column = data.draw(st.integers(0, TOPICS[name].width - 1))
    bit = data.draw(st.integers(0, 63))
    values = {}

    def change(topic, k, row):
        if (topic, k) != (name, step):
            return row
        changed = row.copy()
        changed.view(np.uint64)[column] ^= np.uint64(1 << bit)
        values["first"], values["second"] = row[column], changed[column]
        return changed

    folder = tmp_path_factory.mktemp("bit") / "b"
    write_sample(folder, STEPS, change=change, block_ns=block_ns)
    found = compare(original, folder)
    assert (found.topic, found.index, found.stamp_ns) == (name, step, step * STEP_NS - 500)
    assert found.field == TOPICS[name].fields[column]
    for side in ("first", "second"):
        assert struct.pack("<d", getattr(found, side)) == struct.pack("<d", values[side])


def test_the_earliest_difference_is_reported(tmp_path, original):
    def change(topic, k, row):
        late = {"/clock": 999, "/bar/pose": 71, "/bar/twist": 33}.get(topic, 999)
        return row + 1.0 if k >= late else row

    write_sample(tmp_path / "b", STEPS, change=change)
    found = compare(original, tmp_path / "b")
    assert (found.topic, found.index, found.field) == ("/bar/twist", 33, "vx")
    assert str(found).startswith("/bar/twist message 33 at 0.032999500 s: vx ")


def poses(folder, values, topics=TOPICS, log_offset=0, stamp_offset=0):
    with RecordingWriter(folder, topics, attachments={}, metadata={}) as writer:
        channel = writer.channel("/bar/pose")
        for i, value in enumerate(values):
            channel.append(i + log_offset, i + stamp_offset, np.full(7, value))
    return folder


def test_bits_count_not_values(tmp_path):
    nan, other_nan = (
        struct.unpack("<d", struct.pack("<Q", 0x7FF8_0000_0000_0000 + k))[0] for k in (0, 1)
    )
    a = poses(tmp_path / "a", [nan, 0.0])
    assert compare(a, poses(tmp_path / "b", [nan, 0.0])) is None
    found = compare(a, poses(tmp_path / "c", [other_nan, 0.0]))
    assert (found.index, found.field) == (0, "x")
    found = compare(a, poses(tmp_path / "d", [nan, -0.0]))
    assert (found.index, found.field, str(found.second)) == (1, "x", "-0.0")


def test_stamps_and_log_times_count(tmp_path):
    a = poses(tmp_path / "a", [1.0, 2.0])
    found = compare(a, poses(tmp_path / "b", [1.0, 2.0], stamp_offset=4))
    assert (found.field, found.first, found.second) == ("stamp", 0, 4)
    c = poses(tmp_path / "c", [1.0, 2.0], log_offset=9)
    found = compare(a, c)
    assert (found.field, found.first, found.second) == ("log_time", 0, 9)
    assert compare(a, c, log_times=False) is None


def test_a_missing_message_and_a_missing_topic(tmp_path, original):
    a, b = poses(tmp_path / "a", [1.0, 2.0, 3.0]), poses(tmp_path / "b", [1.0, 2.0])
    found = compare(a, b)
    assert (found.topic, found.index, found.stamp_ns) == ("/bar/pose", 2, 2)
    assert (found.field, found.first, found.second) == ("message", "present", "missing")
    found = compare(b, a)
    assert (found.index, found.first, found.second) == (2, "missing", "present")
    fewer = {name: topic for name, topic in TOPICS.items() if name != "/clock"}
    c = poses(tmp_path / "c", [1.0, 2.0], topics=fewer)
    assert str(compare(b, c)) == "/clock: topic 'present' against 'missing'"
    assert str(compare(c, b)) == "/clock: topic 'missing' against 'present'"


def test_types_names_and_frames_count(tmp_path):
    a = poses(tmp_path / "a", [1.0])
    twist = {**TOPICS, "/clock": Topic("/clock", "std_msgs/msg/String", "", ())}
    found = compare(a, poses(tmp_path / "b", [1.0], topics=twist))
    assert (found.topic, found.field, found.second) == ("/clock", "type", "std_msgs/msg/String")
    other = {
        **TOPICS,
        "/bar/pose": Topic(
            "/bar/pose", TOPICS["/bar/pose"].ros_type, WINCH_FRAME, TOPICS["/bar/pose"].fields
        ),
    }
    found = compare(a, poses(tmp_path / "c", [1.0], topics=other))
    assert (found.field, found.first, found.second) == ("header.frame_id", "world_ned", WINCH_FRAME)
    renamed = contract_topics(["hoist_1", "surge_1", "sway_2"], has_bar=True, has_winch_frame=True)
    write_sample(tmp_path / "d", 5)
    write_sample(tmp_path / "e", 5, topics=renamed)
    found = compare(tmp_path / "d", tmp_path / "e")
    assert (found.topic, found.field) == ("/winches/state", "name[2]")


def diagnostics(folder, value):
    with RecordingWriter(folder, TOPICS, attachments={}, metadata={}) as writer:
        status = [(Level.OK, "a", "b", {"k": "v"}), (Level.OK, "a", "b", {"k": value})]
        writer.append_payload("/diagnostics", 3, encode_diagnostics(8, status))
    return folder


def test_diagnostics_are_compared_field_by_field(tmp_path):
    a = diagnostics(tmp_path / "a", "v")
    assert compare(a, diagnostics(tmp_path / "b", "v")) is None
    found = compare(a, diagnostics(tmp_path / "c", "w"))
    assert (found.topic, found.index, found.stamp_ns) == ("/diagnostics", 0, 8)
    assert (found.field, found.first, found.second) == ("status[1].values[0].value", "v", "w")


def rewrite(source, target, change=lambda payload: payload):
    """Write the messages of a recording anew with the stock writer, other ids and chunks."""
    with target.open("wb") as file, Recording(source) as recording:
        writer = Writer(file, chunk_size=3000, compression=CompressionType.LZ4)
        writer.start(profile="ros2")
        for name, info in reversed(recording.topics.items()):
            text = definition(info.ros_type).encode()
            schema = writer.register_schema(info.ros_type, "ros2msg", text)
            channel = writer.register_channel(name, "cdr", schema)
            logs, payloads = recording.payloads(name)
            for log, payload in zip(logs.tolist(), payloads, strict=True):
                writer.add_message(channel, log, change(payload), log)
        writer.finish()
    return target


def test_the_same_messages_in_another_file_are_identical(tmp_path, original):
    assert compare(original, rewrite(original, tmp_path / "b.mcap")) is None
    assert compare(rewrite(original, tmp_path / "b.mcap"), original) is None


def test_padding_does_not_count(tmp_path):
    a = poses(tmp_path / "a", [1.0, 2.0])
    b = rewrite(a, tmp_path / "b.mcap", lambda p: p[:26] + b"\xaa\xbb" + p[28:])
    assert compare(a, b) is None
    c = rewrite(a, tmp_path / "c.mcap", lambda p: p[:25] + b"\xaa\xbb\xcc" + p[28:])
    assert compare(a, c) is not None


def test_bytes_that_are_no_message_are_compared_as_bytes(tmp_path):
    a = poses(tmp_path / "a", [1.0])
    b = rewrite(a, tmp_path / "b.mcap", lambda p: b"abc")
    found = compare(b, a)
    assert (found.topic, found.field, found.first) == ("/bar/pose", "bytes", "616263")
