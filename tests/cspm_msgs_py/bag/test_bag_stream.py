"""Streaming bags: what was written is what comes, in order, whoever wrote it."""

import shutil
import sqlite3
from itertools import pairwise

import pytest
from bag_samples import (
    FLAG,
    NOETIC,
    SILENT,
    START_NS,
    TEXT,
    TYPES,
    WRITERS,
    Written,
    assert_same,
    clock_messages,
    expected,
    sample_messages,
    stream,
    write_mcap,
    write_rosbag2,
)
from recording_samples import STEP_NS, write_sample
from rosbags.rosbag1 import Writer as Rosbag1Writer

from cspm_msgs_py.bag import BagMessage, BagTopic, open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.mcap_file import McapFile
from cspm_msgs_py.recording.writer import BLOCK_NS
from cspm_msgs_py.ros_types import deserialize, message_class, serialize, typestore
from cspm_msgs_py.yaml_file import dump_yaml, parse_yaml


def count_of(written, topic):
    return sum(message.topic == topic for message in written)


@pytest.mark.parametrize("unordered", [0, 3])
@pytest.mark.parametrize("writer", WRITERS)
def test_what_was_written_is_streamed_in_order(tmp_path, writer, unordered):
    written = sample_messages(300, unordered=unordered)
    path = WRITERS[writer](tmp_path / "bag", written)
    with open_bag(path) as bag:
        found = list(bag.messages())
        assert bag.unplayable == {}
        assert bag.topics == {
            name: BagTopic(name, kind, count_of(written, name)) for name, kind in TYPES.items()
        }
        logs = [message.log_ns for message in written]
        assert (bag.start_ns, bag.end_ns) == (min(logs), max(logs))
    assert found == expected(written)
    assert len({message.log_ns for message in found}) < 100  # most log times are shared
    assert bag.topics[SILENT].count == 0 < bag.topics[FLAG].count


@pytest.mark.parametrize("writer", WRITERS)
def test_equal_log_times_keep_their_order(tmp_path, writer):
    one_topic = clock_messages([START_NS] * 60)
    others = sample_messages(60, seed=3)
    mixed = [item for pair in zip(one_topic, others, strict=True) for item in pair]
    written = [Written(START_NS, topic, message) for _, topic, message in mixed]
    found = stream(WRITERS[writer](tmp_path / "bag", written))
    assert found == expected(written)
    numbers = [
        deserialize(m.payload, TYPES["/clock"]).clock.nanosec for m in found if m.topic == "/clock"
    ]
    numbered = [m for m in written if m.topic == "/clock"]
    assert numbers == [m.message.clock.nanosec for m in numbered]


@pytest.mark.parametrize(
    "writer", ["SQLITE3, version 8, compressed NONE", "mcap NONE", "ROS 1 None"]
)
@pytest.mark.parametrize("after_ms", [-5, 0, 30, 1000])
@pytest.mark.parametrize("topics", [None, ["/clock"], [FLAG, "/bar/pose"], [SILENT], []])
def test_topics_and_start_are_chosen(tmp_path, writer, after_ms, topics):
    written = sample_messages(200, unordered=2)
    start = START_NS + after_ms * 1_000_000
    found = stream(WRITERS[writer](tmp_path / "bag", written), topics, start_ns=start)
    chosen = [
        message
        for message in expected(written)
        if message.log_ns >= start and (topics is None or message.topic in topics)
    ]
    assert found == chosen


@pytest.mark.parametrize("writer", ["SQLITE3, version 9, compressed NONE", "mcap LZ4", "ROS 1 BZ2"])
def test_two_streams_of_one_bag_do_not_disturb_each_other(tmp_path, writer):
    written = sample_messages(100, unordered=2)
    with open_bag(WRITERS[writer](tmp_path / "bag", written)) as bag:
        pairs = list(zip(bag.messages(), bag.messages(), strict=True))
    assert all(one == other for one, other in pairs)
    assert [one for one, _ in pairs] == expected(written)


LOGS = {
    "SQLITE3, version 9, compressed NONE": [-(2**63), -1, 0, 1, 2**63 - 1],
    "mcap NONE": [0, 1, 2**63 - 1],
    "mcap without chunks": [0, 1, 2**63 - 1],
    "ROS 1 None": [0, 1, 2**31 * 10**9, (2**32 - 1) * 10**9 + 999_999_999],
}


@pytest.mark.parametrize("writer", LOGS)
def test_all_log_times_that_a_file_can_hold_are_streamed(tmp_path, writer):
    latest = message_class("builtin_interfaces/msg/Time")(2**31 - 1, 999_999_999)
    kind = message_class(TYPES["/clock"])
    written = [Written(log, "/clock", kind(latest)) for log in LOGS[writer]]
    path = WRITERS[writer](tmp_path / "bag", written)
    path = path / "bag.db3" if path.is_dir() else path
    with open_bag(path) as bag:
        assert list(bag.messages()) == expected(written)
        assert (bag.start_ns, bag.end_ns) == (LOGS[writer][0], LOGS[writer][-1])


@pytest.mark.parametrize("chunked", [True, False])
def test_a_later_log_time_is_left_out_and_counted(tmp_path, chunked):
    logs = [5, 2**63, 7, 2**64 - 1]
    path = write_mcap(tmp_path / "late.mcap", clock_messages(logs), chunked=chunked)
    with open_bag(path) as bag:
        assert [message.log_ns for message in bag.messages()] == [5, 7]
        assert bag.topics["/clock"].count == 2
        assert (bag.start_ns, bag.end_ns) == (5, 7)
        assert bag.faults == [f"{path}: 2 messages logged later than {2**63 - 1} ns left out"]


def collect(bag, found):
    for message in bag.messages():
        found.append(message)


MAGIC = {"mcap ZSTD": b"\x28\xb5\x2f\xfd", "ROS 1 LZ4": b"\x04\x22\x4d\x18"}


@pytest.mark.parametrize("writer", MAGIC)
def test_a_chunk_is_read_when_its_time_comes(tmp_path, writer):
    path = WRITERS[writer](tmp_path / "bag", clock_messages([1000 * i for i in range(500)]))
    content = bytearray(path.read_bytes())
    middle = content.index(MAGIC[writer], len(content) // 2)
    content[middle : middle + 4] = bytes(4)
    path.write_bytes(content)
    found = []
    with open_bag(path) as bag:
        with pytest.raises(InputError, match=r"bag: .*chunk at byte"):
            collect(bag, found)
        assert 10 < len(found) < bag.topics["/clock"].count - 10
    assert [message.log_ns for message in found] == [1000 * i for i in range(len(found))]


def split(path, written, storage, *, parts=3, compression="NONE"):
    """Write a rosbag2 folder of several files, as a recorder does that splits by size."""
    path.mkdir()
    names, metadata = [], {}
    for i in range(parts):
        share = written[i * len(written) // parts : (i + 1) * len(written) // parts]
        part = write_rosbag2(path / f"part_{i}", share, storage, compression=compression)
        metadata = parse_yaml((part / "metadata.yaml").read_text(), "part")
        name = metadata["rosbag2_bagfile_information"]["relative_file_paths"][0]
        names.append(name)
        shutil.move(part / name, path / name)
        shutil.rmtree(part)
    metadata["rosbag2_bagfile_information"]["relative_file_paths"] = names
    (path / "metadata.yaml").write_text(dump_yaml(metadata))
    return path


@pytest.mark.parametrize("compression", ["NONE", "FILE", "MESSAGE"])
@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
@pytest.mark.parametrize("unordered", [0, 20])
def test_several_files_are_one_bag(tmp_path, storage, compression, unordered):
    written = sample_messages(300, unordered=unordered)
    path = split(tmp_path / "bag", written, storage, compression=compression)
    with open_bag(path) as bag:
        assert list(bag.messages()) == expected(written)
        assert sum(topic.count for topic in bag.topics.values()) == 300


def test_unpacked_files_are_removed(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    path = write_rosbag2(tmp_path / "bag", sample_messages(10), "SQLITE3", compression="FILE")
    with open_bag(path) as bag:
        assert len(list(bag.messages())) == 10
        assert len(list(folder.rglob("*.db3"))) == 1
    assert list(folder.glob("*/*/*")) == []


STEPS = 120


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag") / "calm"
    write_sample(folder, STEPS, start_ns=START_NS)
    return folder


@pytest.mark.parametrize("inside", [".", "calm_0.mcap"])
def test_own_recordings_are_streamed(recording, inside):
    found = stream(recording / inside)
    assert all(one.log_ns <= other.log_ns for one, other in pairwise(found))
    with Recording(recording) as reader:
        for name, info in reader.topics.items():
            logs, payloads = reader.payloads(name)
            mine = [message for message in found if message.topic == name]
            assert [message.log_ns for message in mine] == logs.tolist()
            assert [message.payload for message in mine] == payloads
            assert len(mine) == info.count > 0
        assert len(found) == sum(info.count for info in reader.topics.values())


def test_own_recordings_keep_the_order_of_topics_within_a_step(recording):
    found = stream(recording)
    with open_bag(recording) as bag:
        order = list(bag.topics)
    steps = {log: [] for log in sorted({message.log_ns for message in found})}
    for message in found:
        steps[message.log_ns].append(order.index(message.topic))
    assert len(steps) == STEPS
    assert all(places == sorted(places) for places in steps.values())


@pytest.mark.parametrize("whole", [1, 2])
def test_a_recording_cut_short_is_streamed_as_far_as_it_goes(recording, tmp_path, whole):
    folder = tmp_path / "calm"
    folder.mkdir()
    shutil.copy(recording / "metadata.yaml", folder)
    with McapFile(recording / "calm_0.mcap") as file:
        cut = file.chunks[whole].record.offset + file.chunks[whole].record.length // 2
    (folder / "calm_0.mcap").write_bytes((recording / "calm_0.mcap").read_bytes()[:cut])
    complete = stream(recording)
    lost_ns = START_NS + whole * BLOCK_NS
    with open_bag(folder) as bag:
        found = list(bag.messages())
        assert found == [message for message in complete if message.log_ns < lost_ns]
        assert sum(topic.count for topic in bag.topics.values()) == len(found) < len(complete)
        assert (bag.start_ns, bag.end_ns) == (START_NS, lost_ns - STEP_NS)


def test_what_a_running_sqlite_recorder_has_committed_is_streamed(tmp_path):
    written = sample_messages(40)
    path = write_rosbag2(tmp_path / "bag", written, "SQLITE3") / "bag.db3"
    recorder = sqlite3.connect(path)
    try:
        recorder.execute("PRAGMA journal_mode = WAL")
        clock = serialize(clock_messages([0])[0].message)
        recorder.execute(
            "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)",
            (START_NS + 10**12, clock),
        )
        recorder.commit()
        found = stream(path)
    finally:
        recorder.close()
    assert found == [*expected(written), BagMessage(START_NS + 10**12, "/clock", clock)]


def test_a_sqlite_bag_without_index_of_times_is_streamed_in_order(tmp_path):
    written = sample_messages(200, unordered=5)
    path = write_rosbag2(tmp_path / "bag", written, "SQLITE3") / "bag.db3"
    with sqlite3.connect(path) as database:
        database.execute("DROP INDEX timestamp_idx")
    database.close()
    assert stream(path) == expected(written)


def test_several_senders_of_one_topic_are_one_topic(tmp_path):
    path = tmp_path / "two.bag"
    payload = NOETIC.serialize_ros1(NOETIC.types["std_msgs/msg/String"]("a"), "std_msgs/msg/String")
    with Rosbag1Writer(path) as writer:
        senders = [
            writer.add_connection(TEXT, "std_msgs/msg/String", typestore=NOETIC, callerid=caller)
            for caller in ("/one", "/two")
        ]
        for i in range(10):
            writer.write(senders[i % 2], i // 3, payload)
    with open_bag(path) as bag:
        assert bag.topics == {TEXT: BagTopic(TEXT, "std_msgs/msg/String", 10)}
        assert [message.log_ns for message in bag.messages()] == [i // 3 for i in range(10)]


def test_no_field_of_a_message_is_lost(tmp_path):
    written = sample_messages(60)
    for writer in ("SQLITE3, version 9, compressed NONE", "mcap ZSTD", "ROS 1 LZ4"):
        found = stream(WRITERS[writer](tmp_path / writer[:4], written))
        for message, (log, topic, original) in zip(found, written, strict=True):
            assert (message.log_ns, message.topic) == (log, topic)
            assert_same(typestore().deserialize_cdr(message.payload, TYPES[topic]), original)
