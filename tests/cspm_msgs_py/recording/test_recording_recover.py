"""Recovering recordings that were not closed."""

import os
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from recording_samples import ATTACHMENTS, METADATA, STEP_NS, TOPICS, write_sample
from rosbags.highlevel import AnyReader

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.recording import Recording, first_difference, overview, recover
from cspm_msgs_py.recording.sink import McapSink
from cspm_msgs_py.ros_types import definition, type_hash

STEPS = 230
SAMPLES = Path(__file__).resolve().parents[4] / "shared" / "data" / "mcap_samples"


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recover") / "calm"
    write_sample(folder, STEPS)
    with Recording(folder) as recording:
        ends = [place.index_end for place in recording.files[0].chunks]
    return folder, ends


def kill(folder, source, end):
    """Make a folder that holds the first `end` bytes of a recording."""
    folder.mkdir()
    (folder / "calm_0.mcap").write_bytes((source / "calm_0.mcap").read_bytes()[:end])
    (folder / "metadata.yaml").write_text((source / "metadata.yaml").read_text())
    return folder


def test_a_killed_file_becomes_whole_and_the_original_is_kept(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[2] + 5)
    before = (folder / "calm_0.mcap").read_bytes()
    report = recover(folder)
    assert report.restored == [folder / "calm_0.mcap"]
    assert report.kept == [folder / "calm_0.mcap.broken"]
    assert report.kept[0].read_bytes() == before
    assert (report.end_ns, report.damaged, report.lost_bytes) == (149 * STEP_NS, 0, 5)
    assert report.counts["/bar/pose"] == 150
    assert report.messages == 150 * (len(TOPICS) - 1) + 15
    with Recording(folder) as recording, Recording(source) as whole:
        assert recording.complete
        assert recording.attachments == ATTACHMENTS
        assert recording.metadata["cspm"] == METADATA
        found, expected = recording.rows("/bar/pose"), whole.rows("/bar/pose")
    np.testing.assert_array_equal(found.rows, expected.rows[:150])
    with AnyReader([folder]) as bag:
        assert bag.message_count == report.messages
    with (folder / "calm_0.mcap").open("rb") as file:
        assert (
            sum(1 for _ in make_reader(file, validate_crcs=True).iter_messages()) == report.messages
        )


def test_a_recording_that_lacks_only_its_end_comes_back_identical(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[-1])
    recover(folder)
    with Recording(folder) as recording, Recording(source) as whole:
        assert first_difference(recording, whole) is None
    assert (folder / "metadata.yaml").read_text() == (source / "metadata.yaml").read_text()


def test_a_second_recovery_does_nothing(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    first = recover(folder)
    content = {path: path.read_bytes() for path in folder.iterdir()}
    second = recover(folder)
    assert second.restored == second.kept == []
    assert second.counts == first.counts
    assert {path: path.read_bytes() for path in folder.iterdir()} == content


def test_a_whole_recording_is_left_alone(sample):
    content = {path: path.read_bytes() for path in sample[0].iterdir()}
    report = recover(sample[0])
    assert (report.restored, report.counts["/clock"]) == ([], STEPS)
    assert {path: path.read_bytes() for path in sample[0].iterdir()} == content


def test_into_another_folder(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    before = (folder / "calm_0.mcap").read_bytes()
    report = recover(folder, tmp_path / "out")
    assert report.restored == [tmp_path / "out" / "out_0.mcap"]
    assert (folder / "calm_0.mcap").read_bytes() == before
    assert overview(tmp_path / "out").message_count == report.messages
    with pytest.raises(InputError, match=r"/out: already exists, allowed: a new folder$"):
        recover(folder, tmp_path / "out")


def test_a_folder_without_metadata_gets_it(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    (folder / "metadata.yaml").unlink()
    recover(folder)
    with AnyReader([folder]) as bag:
        assert bag.message_count == overview(folder).message_count
        assert {c.topic: c.digest for c in bag.connections} == {
            name: type_hash(topic.ros_type) for name, topic in TOPICS.items()
        }
        assert all(c.ext.offered_qos_profiles[0].depth == 10 for c in bag.connections)


def test_the_file_alone_mends_the_metadata_of_its_folder(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    recover(folder / "calm_0.mcap")
    with AnyReader([folder]) as bag:
        assert bag.message_count == overview(folder).message_count


def test_a_file_that_is_alone_stays_alone(tmp_path, sample):
    source, ends = sample
    path = tmp_path / "alone.mcap"
    path.write_bytes((source / "calm_0.mcap").read_bytes()[: ends[0]])
    assert recover(path).counts["/bar/pose"] == 50
    assert sorted(os.listdir(tmp_path)) == ["alone.mcap", "alone.mcap.broken"]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_the_complete_messages_of_a_cut_chunk_are_kept(tmp_path, compression):
    path = tmp_path / "a.mcap"
    rng = np.random.default_rng(3)
    payloads = [rng.bytes(4000) for _ in range(300)]
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=10**9)
        writer.start(profile="ros2")
        text = definition("std_msgs/msg/String").encode()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", text)
        channel = writer.register_channel("/words", "cdr", schema)
        for i, payload in enumerate(payloads):
            writer.add_message(channel, i, payload, i)
        writer.finish()
    path.write_bytes(path.read_bytes()[:900_000])
    # The only channel stands in the cut chunk: reading needs it, recovering finds it there.
    with pytest.raises(InputError, match="not closed, and holds no channel and no message"):
        Recording(path)
    report = recover(path)
    assert 130 <= report.messages <= 225
    with Recording(path) as recording:
        assert recording.payloads("/words").payloads == payloads[: report.messages]


@pytest.mark.parametrize("use_chunking", [True, False])
def test_files_of_the_stock_writer_are_restored(tmp_path, use_chunking):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=2000, use_chunking=use_chunking)
        writer.start(profile="ros1")
        schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
        channel = writer.register_channel("/words", "ros1", schema)
        for i in range(500):
            writer.add_message(channel, i, bytes([i % 256] * 20), i)
        writer.add_attachment(0, 0, "note", "text/plain", b"hello")
        writer.flush()
    report = recover(path)
    assert report.counts == {"/words": 500}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert [m.log_time for _, _, m in reader.iter_messages()] == list(range(500))
        assert [a.data for a in reader.iter_attachments()] == [b"hello"]
        assert reader.get_header().profile == "ros1"


def test_a_damaged_chunk_is_left_out_and_said(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[3])
    with Recording(folder) as recording:
        chunk = recording.files[0].chunks[1].record
    content = bytearray((folder / "calm_0.mcap").read_bytes())
    content[chunk.end - 50] ^= 0x10
    (folder / "calm_0.mcap").write_bytes(content)
    report = recover(folder)
    assert (report.damaged, report.counts["/bar/pose"]) == (1, 150)
    with Recording(folder) as recording:
        logs = recording.rows("/bar/pose").log_ns // STEP_NS
    assert logs.tolist() == [*range(50), *range(100, 200)]


def test_a_failure_leaves_the_original_where_it_was(tmp_path, sample, monkeypatch):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    content = {path: path.read_bytes() for path in folder.iterdir()}

    def full(sink, chunk, index):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(McapSink, "add_chunk", full)
    with pytest.raises(CspmError, match=r"k: cannot be restored \(No space left on device\)$"):
        recover(folder)
    assert {path: path.read_bytes() for path in folder.iterdir()} == content


def test_an_earlier_original_is_not_overwritten(tmp_path, sample):
    source, ends = sample
    folder = kill(tmp_path / "k", source, ends[1])
    (folder / "calm_0.mcap.broken").write_bytes(b"kept")
    with pytest.raises(
        InputError, match=r"calm_0.mcap.broken: already exists, allowed: move it away first$"
    ):
        recover(folder)
    assert (folder / "calm_0.mcap.broken").read_bytes() == b"kept"


def test_what_cannot_be_recovered_gives_one_line(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "picture.mcap").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    for name, text in {
        "nowhere": "nowhere: no such file or folder$",
        "folder": "folder: a folder without MCAP files, allowed: a rosbag2 folder$",
        "picture.mcap": "picture.mcap: not an MCAP file",
    }.items():
        with pytest.raises(InputError, match=text):
            recover(tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == ["folder", "picture.mcap"]


@pytest.mark.parametrize("name", ["test_bag_mcap", "compressed.mcap"])
def test_samples_of_others_come_through(tmp_path, name):
    if not SAMPLES.exists():
        pytest.skip("the sample recordings are not on this machine")
    report = recover(SAMPLES / name, tmp_path / "out")
    assert report.messages == overview(SAMPLES / name).message_count
    with Recording(tmp_path / "out") as copy, Recording(SAMPLES / name) as original:
        assert first_difference(copy, original) is None
