"""Messages that nobody obeyed: recorded as they came, and apart from those that counted."""

from collections import Counter

import numpy as np
import pytest
from mcap.reader import make_reader
from recording_samples import ROW_TOPICS

from cspm_msgs_py.message import message_of
from cspm_msgs_py.recording import Recording, overview
from cspm_msgs_py.recording.recover import recover
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.yaml_file import parse_yaml

POSE = ROW_TOPICS["/bar/pose"]
ROW = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0])
MS = 1_000_000
ON = "/refused/bar/pose"


def abroad(k):
    """Return CDR bytes of a pose in another frame."""
    message = message_of(POSE, k * MS, ROW)
    message.header.frame_id = "map"
    return serialize(message)


def record(folder, refused):
    with RecordingWriter(folder, {POSE.name: POSE}, attachments={}, metadata={}) as writer:
        for k in range(200):
            writer.channel(POSE.name).append(k * MS, k * MS, ROW)
            if k in refused:
                writer.append_refused(POSE.name, k * MS, abroad(k))
    assert writer.counts == {POSE.name: 200}
    return folder


def test_they_are_there_and_do_not_count(tmp_path):
    folder = record(tmp_path / "bag", {70, 71, 199})
    with Recording(folder) as recording:
        assert recording.refused == {ON: 3}
        rows = recording.rows(POSE.name)
        assert recording.topic(POSE.name).frame_id == "world_ned"
    np.testing.assert_array_equal(rows.stamp_ns, np.arange(200) * MS)
    found = overview(folder)
    assert found.refused == {ON: 3}
    assert [topic.count for topic in found.topics] == [200]


@pytest.mark.parametrize("numbers", [{70, 71, 199}, ()])
def test_info_counts_them(tmp_path, cspm, numbers):
    code, out, _ = cspm("info", record(tmp_path / "bag", numbers))
    said = "refused: 3 messages on /refused/bar/pose, which no node of the run obeyed"
    assert (code, said in " ".join(out.split())) == (0, bool(numbers))


def test_a_recording_without_any_is_as_before(tmp_path):
    with Recording(record(tmp_path / "bag", ())) as recording:
        assert recording.refused == {}
        assert len(recording.files[0].channels) == 1


def test_they_survive_a_writer_that_was_killed(tmp_path):
    folder = record(tmp_path / "bag", {70, 71})
    path = folder / "bag_0.mcap"
    content = path.read_bytes()
    path.write_bytes(content[: content.rindex(b"world_ned")])
    assert recover(folder).restored
    with Recording(folder) as recording:
        assert recording.refused == {ON: 2}


def test_another_reader_finds_on_the_topic_what_was_obeyed_and_nothing_else(tmp_path):
    """With the MCAP library and the metadata that `ros2 bag play` goes by."""
    folder = record(tmp_path / "bag", {70, 71, 199})
    counts = Counter()
    with (folder / "bag_0.mcap").open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            counts[channel.topic] += 1
            assert (b"map" in message.data) == (channel.topic == ON)
    assert counts == {POSE.name: 200, ON: 3}
    listed = parse_yaml((folder / "metadata.yaml").read_text(), "metadata")
    about = listed["rosbag2_bagfile_information"]["topics_with_message_count"]
    assert {e["topic_metadata"]["name"]: e["message_count"] for e in about} == counts
    assert {e["topic_metadata"]["type"] for e in about} == {POSE.ros_type}
