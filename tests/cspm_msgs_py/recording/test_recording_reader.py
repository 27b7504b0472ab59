"""Reading recordings, this project's and those of others."""

from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from recording_samples import ATTACHMENTS, METADATA, ROW_TOPICS, STEP_NS, TOPICS, write_sample
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer

from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.message import message_of
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.ros_types import definition, serialize, typestore
from cspm_msgs_py.yaml_file import dump_yaml, parse_yaml

STEPS = 230
SAMPLES = Path(__file__).resolve().parents[4] / "shared" / "data" / "mcap_samples"
POSE = TOPICS["/bar/pose"]


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reader") / "calm"
    return folder, write_sample(folder, STEPS, start_ns=7_000_000_000)


@pytest.mark.parametrize("inside", [".", "calm_0.mcap"])
def test_every_row_comes_back(sample, inside):
    folder, written = sample
    with Recording(folder / inside) as recording:
        found = recording.rows_of(ROW_TOPICS)
        assert recording.complete
        assert (recording.start_ns, recording.end_ns) == (7_000_000_000, 7_229_000_000)
        assert recording.attachments == ATTACHMENTS
        assert recording.metadata["cspm"] == METADATA
        assert {name: info.ros_type for name, info in recording.topics.items()} == {
            name: topic.ros_type for name, topic in TOPICS.items()
        }
        for name, topic in ROW_TOPICS.items():
            assert recording.topic(name) == topic
    logs = 7_000_000_000 + np.arange(STEPS) * STEP_NS
    for name, rows in written.items():
        np.testing.assert_array_equal(found[name].log_ns, logs)
        np.testing.assert_array_equal(found[name].stamp_ns, logs - 500)
        np.testing.assert_array_equal(found[name].rows, rows)


@pytest.mark.parametrize("kept", [1, 117, STEPS])
def test_rows_up_to_a_time_are_the_first_ones(sample, kept):
    with Recording(sample[0]) as recording:
        until_ns = recording.start_ns + (kept - 1) * STEP_NS
        found = recording.rows_of(ROW_TOPICS, until_ns)
        for name, rows in recording.rows_of(ROW_TOPICS).items():
            assert len(found[name].log_ns) == kept
            for part, whole in zip(found[name], rows, strict=True):
                np.testing.assert_array_equal(part, whole[:kept])


def test_chunks_beyond_the_time_are_not_read(sample, monkeypatch):
    read = []
    with Recording(sample[0]) as recording:
        [file] = recording.files
        assert len(file.chunks) > 2
        messages = file.messages
        monkeypatch.setattr(
            file, "messages", lambda place, index=None: read.append(place) or messages(place, index)
        )
        recording.rows_of(ROW_TOPICS, recording.start_ns)
    assert read == file.chunks[:1]


def test_payloads_come_back(sample):
    with Recording(sample[0]) as recording:
        logs, payloads = recording.payloads("/diagnostics")
    assert logs.tolist() == list(range(7_000_000_000, 7_230_000_000, 10 * STEP_NS))
    found = [decode_diagnostics(payload).statuses[0].values["step"] for payload in payloads]
    assert found == [str(step) for step in range(0, STEPS, 10)]


def write_foreign(path, payloads, *, topic="/bar/pose", **options):
    """Write payloads 1 ms apart with the writer of `mcap`; return the file's path."""
    kind = options.pop("kind", POSE.ros_type)
    schema = options.pop("schema", (kind, "ros2msg", definition(POSE.ros_type).encode()))
    encoding = options.pop("encoding", "cdr")
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2")
        channel = writer.register_channel(topic, encoding, writer.register_schema(*schema))
        for i, payload in enumerate(payloads):
            writer.add_message(channel, i * STEP_NS, payload, i * STEP_NS)
        writer.finish()
    return path


def pose_payloads(count, topic=POSE):
    rows = np.random.default_rng(1).normal(size=(count, topic.width))
    messages = [message_of(topic, i, row) for i, row in enumerate(rows)]
    return rows, [serialize(message) for message in messages]


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.NONE])
@pytest.mark.parametrize("use_chunking", [True, False])
def test_files_of_the_stock_writer_are_read(tmp_path, compression, index_types, use_chunking):
    rows, payloads = pose_payloads(300)
    options = {"compression": compression, "index_types": index_types}
    path = write_foreign(
        tmp_path / "a.mcap", payloads, chunk_size=4096, use_chunking=use_chunking, **options
    )
    with Recording(path) as recording:
        found = recording.rows("/bar/pose")
        assert (recording.start_ns, recording.end_ns) == (0, 299 * STEP_NS)
        assert recording.topics["/bar/pose"].count == 300
    np.testing.assert_array_equal(found.rows, rows)
    np.testing.assert_array_equal(found.stamp_ns, np.arange(300))


def test_a_file_without_statistics_is_counted(tmp_path):
    rows, payloads = pose_payloads(300)
    path = write_foreign(tmp_path / "a.mcap", payloads, chunk_size=4096, use_statistics=False)
    with Recording(path) as recording:
        assert recording.topics["/bar/pose"].count == 300
        np.testing.assert_array_equal(recording.rows("/bar/pose").rows, rows)


def test_folders_of_rosbags_are_read(tmp_path):
    rows, payloads = pose_payloads(20)
    with Rosbag2Writer(tmp_path / "x", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connection = bag.add_connection("/bar/pose", POSE.ros_type, typestore=typestore())
        for i, payload in enumerate(payloads):
            bag.write(connection, i, payload)
    with Recording(tmp_path / "x") as recording:
        np.testing.assert_array_equal(recording.rows("/bar/pose").rows, rows)


def test_uninitialised_padding_and_trailing_bytes_are_overlooked(tmp_path):
    rows, payloads = pose_payloads(40)
    start, _ = layout_of(POSE).runs[0]
    odd = [
        p[: start - 2] + bytes([i, 255 - i]) + p[start:] + b"\x01" * 8
        for i, p in enumerate(payloads)
    ]
    with Recording(write_foreign(tmp_path / "a.mcap", odd)) as recording:
        found = recording.rows("/bar/pose")
    np.testing.assert_array_equal(found.rows, rows)


def test_messages_of_varying_length_are_read_one_by_one(tmp_path):
    rows, payloads = pose_payloads(40)
    odd = [p + bytes(i % 3) for i, p in enumerate(payloads)]
    with Recording(write_foreign(tmp_path / "a.mcap", odd)) as recording:
        found = recording.rows("/bar/pose")
    np.testing.assert_array_equal(found.rows, rows)


def test_big_endian_messages_are_read(tmp_path):
    message = message_of(POSE, 5_000_000_006, np.arange(7.0))
    payload = bytes(typestore().serialize_cdr(message, POSE.ros_type, little_endian=False))
    with Recording(write_foreign(tmp_path / "a.mcap", [payload] * 3)) as recording:
        found = recording.rows("/bar/pose")
    np.testing.assert_array_equal(found.rows, np.tile(np.arange(7.0), (3, 1)))
    assert found.stamp_ns.tolist() == [5_000_000_006] * 3


def test_a_change_of_frame_is_refused(tmp_path):
    _, payloads = pose_payloads(5)
    changed = payloads[4].replace(b"world_ned", b"wOrld_ned")
    with (
        Recording(write_foreign(tmp_path / "a.mcap", [*payloads, changed])) as recording,
        pytest.raises(
            InputError,
            match=r"a.mcap: message 5 of /bar/pose: other names, lengths or frame than the first",
        ),
    ):
        recording.rows("/bar/pose")


def test_bytes_that_are_no_message_are_refused(tmp_path):
    _, payloads = pose_payloads(5)
    for odd in ([b"abc"], [*payloads, b"abc"]):
        with (
            Recording(write_foreign(tmp_path / "a.mcap", odd)) as recording,
            pytest.raises(InputError, match=r"/bar/pose: 3 bytes that are no geometry_msgs"),
        ):
            recording.rows("/bar/pose")


def test_what_no_row_can_be_read_from_is_refused(tmp_path):
    _, payloads = pose_payloads(2)
    other = definition(POSE.ros_type).replace("float64 w", "float32 w").encode()
    cases = {
        "has other fields than in ROS 2 Jazzy": {"schema": (POSE.ros_type, "ros2msg", other)},
        "is not a message definition": {"schema": (POSE.ros_type, "ros2msg", b"}{")},
        "encoding 'jsonschema', allowed: ros2msg": {"schema": (POSE.ros_type, "jsonschema", b"{}")},
        "is encoded as 'json', allowed: cdr": {"encoding": "json"},
        "my_msgs/msg/Pose carries no row of numbers": {"kind": "my_msgs/msg/Pose"},
    }
    for text, options in cases.items():
        path = write_foreign(tmp_path / "a.mcap", payloads, **options)
        with Recording(path) as recording, pytest.raises(InputError, match=text):
            recording.rows("/bar/pose")


def test_a_missing_topic_names_those_that_are_there(sample):
    with Recording(sample[0]) as recording:
        for read in (recording.rows, recording.payloads, recording.topic):
            with pytest.raises(InputError, match=r"calm: no topic /nose, it has: /clock, /winch_"):
                read("/nose")


def test_a_topic_with_two_types_is_refused(tmp_path):
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for kind in (POSE.ros_type, "std_msgs/msg/String"):
            schema = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            channel = writer.register_channel("/x", "cdr", schema)
            writer.add_message(channel, 0, b"", 0)
        writer.finish()
    with Recording(tmp_path / "a.mcap") as recording:
        assert recording.topics["/x"].ros_type == f"{POSE.ros_type}, std_msgs/msg/String"
        with pytest.raises(InputError, match=r"/x has the types .*, allowed: one$"):
            recording.rows("/x")


def test_a_split_bag_is_one_recording(tmp_path, sample):
    folder, written = sample
    write_sample(tmp_path / "b" / "calm", STEPS, start_ns=8_000_000_000)
    both = tmp_path / "both"
    both.mkdir()
    (both / "calm_0.mcap").write_bytes((folder / "calm_0.mcap").read_bytes())
    (both / "calm_1.mcap").write_bytes((tmp_path / "b" / "calm" / "calm_0.mcap").read_bytes())
    text = (folder / "metadata.yaml").read_text()
    content = parse_yaml(text, "metadata.yaml")
    names = content["rosbag2_bagfile_information"]["relative_file_paths"]
    assert names == ["calm_0.mcap"]
    names.append("calm_1.mcap")
    (both / "metadata.yaml").write_text(dump_yaml(content))
    with Recording(both) as recording:
        found = recording.rows("/bar/pose")
        assert (recording.start_ns, recording.end_ns) == (7_000_000_000, 8_229_000_000)
    np.testing.assert_array_equal(found.rows, np.vstack([written["/bar/pose"]] * 2))
    assert (np.diff(found.log_ns) > 0).all()


def folder_with(path, metadata=None):
    path.mkdir()
    if metadata is not None:
        (path / "metadata.yaml").write_text(metadata)
    return path


BAG = "rosbag2_bagfile_information: {storage_identifier: %s, relative_file_paths: %s}"


def test_what_is_no_recording_gives_one_line(tmp_path):
    png = tmp_path / "picture.mcap"
    png.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    cases = {
        png: r"picture.mcap: not an MCAP file \(its first bytes are no MCAP magic\)",
        empty: "empty.mcap: an empty file, allowed: an MCAP file",
        tmp_path / "nowhere": "nowhere: no such file or folder",
        folder_with(tmp_path / "bare"): "bare: a folder without metadata.yaml, allowed: a rosbag2",
        folder_with(tmp_path / "text", "hello"): "metadata.yaml: not the metadata of a rosbag2 fol",
        folder_with(tmp_path / "colon", "a: b: c"): "metadata.yaml: line 1: ",
        folder_with(tmp_path / "gone", BAG % ("mcap", "[a.mcap]")): "a.mcap: no such file, but",
        folder_with(tmp_path / "none", BAG % ("mcap", "[]")): "metadata.yaml: names no file",
        folder_with(
            tmp_path / "zipped", BAG.replace("}", ", compression_mode: FILE}") % ("mcap", "[a]")
        ): ("compression_mode 'file', allowed: none"),
    }
    for path, text in cases.items():
        with pytest.raises(InputError, match=text) as caught:
            Recording(path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("chunk_not_closed.mcap", "not closed, and holds no channel and no message"),
        ("zstd_chunk_with_padding.mcap", "messages on channel 0, which no record describes"),
        ("test_bag_sqlite3", "stored as sqlite3, allowed: mcap"),
        ("test_bag_sqlite3/test_bag_sqlite3.db3", "not an MCAP file"),
    ],
)
def test_samples_that_must_be_refused(name, text):
    if not SAMPLES.exists():
        pytest.skip("the sample recordings are not on this machine")
    with pytest.raises(InputError, match=text):
        Recording(SAMPLES / name)


def test_the_sample_bag_without_statistics_is_read():
    if not SAMPLES.exists():
        pytest.skip("the sample recordings are not on this machine")
    with Recording(SAMPLES / "test_bag_mcap") as recording:
        assert sum(info.count for info in recording.topics.values()) == 188
        assert recording.files[0].statistics is None
        found = recording.rows("/test/geometry_msgs/pose_stamped")
        assert found.rows.shape == (2, 7)
        with pytest.raises(InputError, match="std_msgs/msg/String carries no row of numbers"):
            recording.rows("/test/std_msgs/string")
