"""What the writer leaves on disk, read by the readers of others."""

import errno
import threading
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, DataEnd, Footer
from mcap.stream_reader import StreamReader
from recording_samples import ATTACHMENTS, METADATA, ROW_TOPICS, STEP_NS, TOPICS, write_sample
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.recording import Recording, RecordingWriter, recover
from cspm_msgs_py.recording.sink import McapSink
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.yaml_file import read_yaml

STEPS = 230


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("writer") / "worst_case"
    return folder, write_sample(folder, STEPS)


def new_writer(folder, topics=TOPICS):
    return RecordingWriter(folder, topics, attachments=ATTACHMENTS, metadata=METADATA)


def append_clock(channel, steps):
    for step in range(steps):
        channel.append(step * STEP_NS, 0, np.zeros(0))


def record_and_raise(folder, log_ns):
    with new_writer(folder) as writer:
        writer.channel("/clock").append(log_ns, 0, np.zeros(0))
        raise KeyError("mine")


def assert_payloads(found, rows):
    """Compare messages of other readers, (topic, log time, payload), with what was written."""
    expected = {
        name: layout_of(TOPICS[name]).encode(np.arange(STEPS) * STEP_NS - 500, rows[name])
        for name in rows
    }
    seen = dict.fromkeys(expected, 0)
    for name, log, payload in found:
        if name in expected:
            assert log == seen[name] * STEP_NS
            assert payload == expected[name][seen[name]].tobytes()
            seen[name] += 1
    assert set(seen.values()) == {STEPS}


def test_the_reader_of_mcap_finds_every_message_in_order(sample):
    folder, rows = sample
    with (folder / "worst_case_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        statistics = reader.get_summary().statistics
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        header = reader.get_header()
    assert_payloads(found, rows)
    assert [log for _, log, _ in found] == sorted(log for _, log, _ in found)
    assert statistics.message_count == len(found) == STEPS * len(ROW_TOPICS) + STEPS // 10
    assert (statistics.message_start_time, statistics.message_end_time) == (0, 229 * STEP_NS)
    assert statistics.chunk_count == 5
    assert attachments == ATTACHMENTS
    assert metadata == {"rosbag2": {"ROS_DISTRO": "jazzy"}, "cspm": METADATA}
    assert header.profile == "ros2"
    assert header.library.startswith("cspm ")


def test_every_checksum_of_the_file_holds(sample):
    path = sample[0] / "worst_case_0.mcap"
    with path.open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True, emit_chunks=True).records)
    chunks = [record for record in records if isinstance(record, Chunk)]
    assert all(chunk.uncompressed_crc for chunk in chunks)
    assert next(r for r in records if isinstance(r, DataEnd)).data_section_crc
    assert next(r for r in records if isinstance(r, Footer)).summary_crc
    channel = next(r for r in records if isinstance(r, Channel) and r.topic == "/bar/pose")
    assert channel.message_encoding == "cdr"
    assert "reliability: reliable" in channel.metadata["offered_qos_profiles"]
    assert channel.metadata["topic_type_hash"].startswith("RIHS01_10f3786d7d40fd2b")


def test_messages_count_up_per_channel_and_lie_in_order_of_time(sample):
    with (sample[0] / "worst_case_0.mcap").open("rb") as file:
        records = [r for r in StreamReader(file).records if type(r).__name__ == "Message"]
    for channel in {record.channel_id for record in records}:
        own = [record.sequence for record in records if record.channel_id == channel]
        assert own == list(range(len(own)))
    keys = [(record.log_time, record.channel_id) for record in records]
    assert keys == sorted(keys)


def test_rosbags_reads_folder_and_file(sample):
    folder, rows = sample
    for path in (folder, folder / "worst_case_0.mcap"):
        with Reader(path) as bag:
            found = [(c.topic, log, bytes(data)) for c, log, data in bag.messages()]
            types = {c.topic: c.msgtype for c in bag.connections}
            assert bag.message_count == len(found)
        assert_payloads(found, rows)
        assert types == {name: topic.ros_type for name, topic in TOPICS.items()}


def test_rosbags_decodes_with_the_definitions_in_the_file(sample):
    folder, rows = sample
    with AnyReader([folder]) as bag:
        connections = [c for c in bag.connections if c.topic == "/winches/state"]
        messages = [bag.deserialize(data, c.msgtype) for c, _, data in bag.messages(connections)]
    found = np.array([[*m.position, *m.velocity, *m.effort] for m in messages])
    np.testing.assert_array_equal(found, rows["/winches/state"])


def test_metadata_names_topics_counts_and_quality_of_service(sample):
    about = read_yaml(sample[0] / "metadata.yaml")["rosbag2_bagfile_information"]
    assert about["relative_file_paths"] == ["worst_case_0.mcap"]
    assert about["duration"]["nanoseconds"] == 229 * STEP_NS
    counts = {
        entry["topic_metadata"]["name"]: entry["message_count"]
        for entry in about["topics_with_message_count"]
    }
    assert counts == {**dict.fromkeys(ROW_TOPICS, STEPS), "/diagnostics": STEPS // 10}
    assert about["message_count"] == sum(counts.values())
    (profile,) = about["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"]
    assert (profile["reliability"], profile["history"], profile["depth"]) == (
        "reliable",
        "keep_last",
        10,
    )


def test_the_file_does_not_depend_on_the_order_of_topics_within_a_step(tmp_path):
    contents = []
    for folder, names in (("a", ["/bar/pose", "/clock"]), ("b", ["/clock", "/bar/pose"])):
        with new_writer(tmp_path / folder) as writer:
            channels = {name: writer.channel(name) for name in names}
            for step in range(120):
                for name in names:
                    row = np.full(TOPICS[name].width, float(step))
                    channels[name].append(step * STEP_NS, step, row)
        contents.append(writer.path.read_bytes())
    assert contents[0] == contents[1]


def test_late_and_repeated_log_times_are_kept(tmp_path):
    logs = [5, 3, 3, 60_000_000, 2]
    with new_writer(tmp_path / "x") as writer:
        channel = writer.channel("/bar/twist")
        for i, log in enumerate(logs):
            channel.append(log, 0, np.full(6, float(i)))
    with Recording(tmp_path / "x") as recording:
        found = recording.rows("/bar/twist")
    assert found.log_ns.tolist() == sorted(logs)
    assert found.rows[:, 0].tolist() == [4, 1, 2, 0, 3]


def test_a_row_is_copied(tmp_path):
    row = np.zeros(6)
    with new_writer(tmp_path / "x") as writer:
        writer.channel("/bar/twist").append(0, 0, row)
        row[:] = 1.0
    with Recording(tmp_path / "x") as recording:
        assert not recording.rows("/bar/twist").rows.any()


def test_nothing_recorded_is_a_recording_too(tmp_path):
    with new_writer(tmp_path / "x") as writer:
        pass
    assert set(writer.counts.values()) == {0}
    with Recording(tmp_path / "x") as recording, Reader(tmp_path / "x") as bag:
        assert recording.complete
        assert recording.rows("/bar/pose").rows.shape == (0, 0)
        assert bag.message_count == 0


def test_an_existing_folder_is_refused_and_left_alone(tmp_path):
    (tmp_path / "x").mkdir()
    with pytest.raises(InputError, match=r"/x: already exists, allowed: a new folder$"):
        new_writer(tmp_path / "x")
    assert not list((tmp_path / "x").iterdir())


def test_a_place_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"/file/x: cannot be written \(Not a directory\)$"):
        new_writer(tmp_path / "file" / "x")


def test_wrong_use_of_topics_is_refused(tmp_path):
    with new_writer(tmp_path / "x") as writer:
        with pytest.raises(
            InputError, match=r"^/nose: not a topic of this recording, allowed: /clo"
        ):
            writer.channel("/nose")
        with pytest.raises(InputError, match=r"^/diagnostics: carries no row of numbers"):
            writer.channel("/diagnostics")
        with pytest.raises(
            InputError, match=r"^/clock: carries a row of numbers, allowed: channel"
        ):
            writer.append_payload("/clock", 0, b"")
        with pytest.raises(InputError, match=r"^/bar/pose: a row of float32, allowed: float64$"):
            writer.channel("/bar/pose").append(0, 0, np.zeros(7, dtype=np.float32))
    with pytest.raises(InputError, match=r"^message type 'a/msg/B' is unknown"):
        new_writer(tmp_path / "y", {"/t": Topic("/t", "a/msg/B", "", ())})
    assert not (tmp_path / "y").exists()


@pytest.mark.parametrize(
    ("log", "stamp", "width", "text"),
    [
        (0, 0, 6, "/bar/pose: a row of another length, allowed: 7 float64"),
        (-1, 0, 7, "/bar/pose: log time -1 ns, allowed: 0 or later"),
        (0, 2**62, 7, "/bar/pose: stamp 4611686018427387904 ns, allowed: "),
        (2**63, 0, 7, "/bar/pose: a time beyond ±9223372036854775807 ns"),
    ],
)
def test_what_a_recording_cannot_hold_fails_at_the_latest_when_closing(
    tmp_path, log, stamp, width, text
):
    writer = new_writer(tmp_path / "x")
    # What is said names the channel, of several in one block.
    append_clock(writer.channel("/clock"), 3)
    writer.channel("/target/pose").append(0, 0, np.zeros(7))
    writer.channel("/bar/pose").append(log, stamp, np.zeros(width))
    with pytest.raises(CspmError, match=r"x_0.mcap: recording failed \(" + text):
        writer.close()
    writer.close()


def test_rows_without_a_stamp_of_their_own_are_refused(tmp_path):
    writer = new_writer(tmp_path / "x")
    writer.channel("/bar/pose").append_rows([0, STEP_NS], [0], np.zeros(14).tobytes())
    with pytest.raises(CspmError, match=r"\(/bar/pose: 1 stamps of 2 messages, allowed: one of"):
        writer.close()


def test_a_full_disk_is_one_line_and_what_was_written_can_be_recovered(tmp_path, monkeypatch):
    writer = new_writer(tmp_path / "x")
    write, written = McapSink._write, []

    def failing(sink, content):
        written.append(content)
        if len(written) > 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        write(sink, content)

    monkeypatch.setattr(McapSink, "_write", failing)
    channel = writer.channel("/clock")
    line = r"x_0.mcap: recording failed \(No space left on device\)$"
    with pytest.raises(CspmError, match=line):
        append_clock(channel, 350)
    with pytest.raises(CspmError, match=line):
        channel.append(350 * STEP_NS, 0, np.zeros(0))
    with pytest.raises(CspmError, match=line):
        writer.close()
    monkeypatch.undo()
    assert recover(tmp_path / "x").counts["/clock"] == 150


def test_appending_after_closing_is_refused(tmp_path):
    writer = new_writer(tmp_path / "x")
    channel = writer.channel("/clock")
    channel.append(0, 0, np.zeros(0))
    writer.close()
    with pytest.raises(CspmError, match=r"x_0.mcap: the recording is closed$"):
        channel.append(1, 0, np.zeros(0))


def test_an_exception_keeps_its_own_face_and_the_recording_is_whole(tmp_path):
    with pytest.raises(KeyError, match="mine"):
        record_and_raise(tmp_path / "x", 0)
    with pytest.raises(KeyError, match="mine"):
        record_and_raise(tmp_path / "y", -1)
    with Recording(tmp_path / "x") as recording:
        assert recording.complete
        assert recording.topics["/clock"].count == 1


def test_the_caller_waits_rather_than_running_more_than_three_blocks_ahead(tmp_path, monkeypatch):
    go, stuck = threading.Event(), threading.Event()
    write_block = RecordingWriter._write_block

    def slow(writer, block, compressor):
        if any(batch.logs for batch in block):
            stuck.set()
            assert go.wait(30)
        write_block(writer, block, compressor)

    monkeypatch.setattr(RecordingWriter, "_write_block", slow)
    writer = new_writer(tmp_path / "x")
    channel = writer.channel("/clock")
    reached = 0

    def fill():
        nonlocal reached
        for step in range(400):
            channel.append(step * STEP_NS, 0, np.zeros(0))
            reached = step + 1

    thread = threading.Thread(target=fill)
    thread.start()
    assert stuck.wait(30)
    thread.join(0.5)
    assert thread.is_alive()
    assert reached == 150
    go.set()
    thread.join(30)
    writer.close()
    assert reached == writer.counts["/clock"] == 400


def test_memory_does_not_grow_with_the_recording(tmp_path):
    tracemalloc = pytest.importorskip("tracemalloc")
    topics = {"/clock": TOPICS["/clock"]}
    held = []
    tracemalloc.start()
    with new_writer(tmp_path / "x", topics) as writer:
        channel = writer.channel("/clock")
        for step in range(6_000):
            channel.append(step * 50_000_000, 0, np.zeros(0))
            if step in (2_000, 5_999):
                held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert held[1] - held[0] < 100_000
    with Recording(tmp_path / "x") as recording:
        assert recording.topics["/clock"].count == 6_000


def test_the_start_of_the_file_carries_attachments_metadata_and_channels(tmp_path):
    writer = new_writer(tmp_path / "x")
    head = Path(writer.path).read_bytes()
    about = read_yaml(tmp_path / "x" / "metadata.yaml")["rosbag2_bagfile_information"]
    writer.close()
    (tmp_path / "head.mcap").write_bytes(head)
    with Recording(tmp_path / "head.mcap") as recording:
        assert recording.attachments == ATTACHMENTS
        assert recording.metadata["cspm"] == METADATA
        assert list(recording.topics) == list(TOPICS)
        assert not recording.complete
    assert about["message_count"] == 0
