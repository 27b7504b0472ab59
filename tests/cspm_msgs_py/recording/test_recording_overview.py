"""What an overview says of a recording."""

from pathlib import Path

import numpy as np
import pytest
from bag_samples import TYPES, WRITERS, sample_messages, stream
from mcap.writer import Writer
from recording_samples import ATTACHMENTS, METADATA, STEP_NS, TOPICS, write_sample

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording, RecordingWriter, overview

SAMPLES = Path(__file__).resolve().parents[4] / "shared" / "data" / "mcap_samples"
STEPS = 230


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("overview") / "calm"
    hole = range(60, 100)

    def change(name, step, row):
        return None if name == "/bar/pose" and step in hole else row

    write_sample(folder, STEPS, change=change, start_ns=10**9)
    return folder


def test_topics_rates_and_gaps(folder):
    found = overview(folder)
    topics = {topic.name: topic for topic in found.topics}
    assert list(topics) == list(TOPICS)
    clock, pose = topics["/clock"], topics["/bar/pose"]
    assert clock.ros_type == "rosgraph_msgs/msg/Clock"
    assert (clock.count, clock.gap_ns) == (STEPS, STEP_NS)
    assert clock.rate_hz == pytest.approx(1000.0)
    assert (clock.first_ns, clock.last_ns) == (10**9, 10**9 + 229 * STEP_NS)
    assert (pose.count, pose.gap_ns, pose.gap_at_ns) == (190, 41 * STEP_NS, 10**9 + 59 * STEP_NS)
    assert pose.rate_hz == pytest.approx(189 / 0.229)


def test_duration_origin_and_state(folder):
    found = overview(folder)
    assert found.complete
    assert found.unread_bytes == 0
    assert (found.storage, found.profile, found.library[:5]) == ("mcap", "ros2", "cspm ")
    assert found.duration_s == pytest.approx(0.229)
    assert found.message_count == sum(topic.count for topic in found.topics)
    assert (found.scenario, found.testbed) == ("calm", "Prüfstand")
    assert found.metadata["cspm"] == METADATA
    assert found.attachments == {name: len(content) for name, content in ATTACHMENTS.items()}
    assert found.size_bytes == (folder / "calm_0.mcap").stat().st_size


def test_a_killed_file(tmp_path, folder):
    with Recording(folder) as recording:
        end = recording.files[0].chunks[2].record.end
    path = tmp_path / "killed.mcap"
    path.write_bytes((folder / "calm_0.mcap").read_bytes()[: end + 3])
    found = overview(path)
    assert not found.complete
    assert found.unread_bytes == 3
    assert {t.name: t.count for t in found.topics}["/clock"] == 150
    assert found.scenario == "calm"


def test_no_message_and_one_message(tmp_path):
    with RecordingWriter(tmp_path / "x", TOPICS, attachments={}, metadata={}) as writer:
        writer.channel("/clock").append(5, 0, np.zeros(0))
    found = overview(tmp_path / "x")
    topics = {topic.name: topic for topic in found.topics}
    one, none = topics["/clock"], topics["/bar/pose"]
    assert (one.count, one.rate_hz, one.first_ns, one.last_ns, one.gap_ns) == (1, None, 5, 5, None)
    assert (none.count, none.rate_hz, none.first_ns, none.gap_ns) == (0, None, None, None)
    assert (found.start_ns, found.end_ns, found.duration_s) == (5, 5, 0.0)
    assert found.scenario is None


def test_chunks_that_overlap_in_time_do_not_make_gaps(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1)
        writer.start(profile="x")
        channel = writer.register_channel("/x", "", 0)
        for time in (0, 10, 40, 20, 30, 90):
            writer.add_message(channel, time, b"", time)
        writer.finish()
    (topic,) = overview(path).topics
    assert (topic.count, topic.first_ns, topic.last_ns) == (6, 0, 90)
    assert (topic.gap_ns, topic.gap_at_ns) == (50, 40)
    assert topic.ros_type == "none"


@pytest.mark.parametrize(
    ("name", "storage", "profile", "messages", "topics"),
    [
        ("test_bag_mcap", "mcap", "ros2", 188, 94),
        ("test_bag_sqlite3", "sqlite3", "", 188, 94),
        ("test_bag_sqlite3/test_bag_sqlite3.db3", "sqlite3", "", 188, 94),
        ("compressed.mcap", "mcap", "ros1", 826, 2),
    ],
)
def test_recordings_of_others(name, storage, profile, messages, topics):
    if not SAMPLES.exists():
        pytest.skip("the sample recordings are not on this machine")
    found = overview(SAMPLES / name)
    assert (found.storage, found.profile, found.message_count) == (storage, profile, messages)
    assert len(found.topics) == topics
    assert found.size_bytes > 0
    if name != "compressed.mcap":
        pose = next(t for t in found.topics if t.name == "/test/geometry_msgs/pose_stamped")
        assert (pose.ros_type, pose.count) == ("geometry_msgs/msg/PoseStamped", 2)
        assert pose.gap_ns == pose.last_ns - pose.first_ns == 9_400_000_000


@pytest.mark.parametrize("kind", WRITERS)
def test_whatever_replay_plays_is_looked_at(tmp_path, kind):
    """The stream of the player is the independent road."""
    written = sample_messages(200)
    path = WRITERS[kind](tmp_path / "bag", written)
    found, played = overview(path), stream(path)
    times = {name: [m.log_ns for m in played if m.topic == name] for name in TYPES}
    assert {topic.name: topic.count for topic in found.topics} == {
        name: len(logs) for name, logs in times.items()
    }
    assert {topic.name: topic.ros_type for topic in found.topics} == TYPES
    assert found.message_count == 200
    clock = next(topic for topic in found.topics if topic.name == "/clock")
    logs = times["/clock"]
    assert (clock.first_ns, clock.last_ns) == (logs[0], logs[-1])
    assert clock.gap_ns == max(np.diff(logs))
    assert found.storage == STORAGES[kind.split()[0].strip(",")]


STORAGES = {"MCAP": "mcap", "mcap": "mcap", "SQLITE3": "sqlite3", "ROS": "rosbag1"}


def test_what_cannot_be_read_gives_one_line(tmp_path):
    broken = tmp_path / "a.db3"
    broken.write_bytes(b"SQLite format 3\x00" + bytes(50))
    with pytest.raises(InputError, match=r"a.db3: not a readable sqlite3 bag \(.*\)$"):
        overview(broken)
    with pytest.raises(InputError, match=r"nowhere: no such file or folder$"):
        overview(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"a folder without metadata.yaml"):
        overview(tmp_path.parent)


@pytest.mark.parametrize("name", ["chunk_not_closed.mcap", "zstd_chunk_with_padding.mcap"])
def test_samples_that_must_be_refused(name):
    if not SAMPLES.exists():
        pytest.skip("the sample recordings are not on this machine")
    with pytest.raises(InputError) as caught:
        overview(SAMPLES / name)
    assert "\n" not in str(caught.value)
