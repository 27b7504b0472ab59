"""ROS 1 bags without a whole index: read as far as they go, and restored."""

import struct

import pytest
from bag_samples import SMALL, clock_messages, sample_messages, stream, write_rosbag1
from rosbags.rosbag1 import Reader

from cspm_msgs_py.bag import open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import overview, recover


def payloads(path):
    return [message.payload for message in stream(path)]


def never_closed(path, content, cut):
    """Write a bag's content with the chunk open that its writer was filling when it was killed.

    `cut` leaves the chunk's length, as where a whole bag is copied in part.
    """
    place = content.index(b"index_pos=") + len(b"index_pos=")
    (index,) = struct.unpack_from("<Q", content, place)
    head = content[:place] + bytes(8) + content[place + 8 :]
    chunk = content.rindex(b"compression=none", 0, index)
    size = content.index(b"size=", chunk) + len(b"size=")
    first_index = content.index(b"op=\x04", size) - 8
    lengths = head[size : size + 8] if cut else bytes(8)
    path.write_bytes(head[:size] + lengths + head[size + 8 : first_index - 9])
    return path


def read_by_others(path):
    with Reader(path) as reader:
        return [payload for _, _, payload in reader.messages()]


@pytest.mark.parametrize("cut", [True, False])
def test_the_chunk_that_was_open_is_read_up_to_its_last_whole_message(tmp_path, cut):
    whole = write_rosbag1(tmp_path / "whole.bag", sample_messages(100), chunk=SMALL)
    path = never_closed(tmp_path / "lab.bag.active", whole.read_bytes(), cut)
    expected, found = payloads(whole), payloads(path)
    assert found == expected[: len(found)]
    assert len(found) == len(expected) - 1
    assert f"{len(found)} messages are read" in overview(path).faults[0]


@pytest.mark.parametrize("compression", [None, "LZ4"])
@pytest.mark.parametrize("damage", ["open", "index cut", "index damaged"])
def test_a_restored_bag_is_whole_for_all_readers(tmp_path, damage, compression):
    written = sample_messages(100)
    whole = write_rosbag1(tmp_path / "whole.bag", written, chunk=SMALL, compression=compression)
    content, path = whole.read_bytes(), tmp_path / "lab.bag"
    place = content.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(
        {
            "open": content[:place] + bytes(8) + content[place + 8 :],
            "index cut": content[:-50],
            "index damaged": content.replace(b"chunk_count=", b"chunk_coint=", 1),
        }[damage]
    )
    broken = path.read_bytes()
    report = recover(path)
    assert (report.messages, report.damaged) == (100, 0)
    assert report.end_ns == max(message.log_ns for message in written)
    assert (tmp_path / "lab.bag.broken").read_bytes() == broken
    assert payloads(path) == payloads(whole)
    assert read_by_others(path) == read_by_others(whole)
    assert overview(path).faults == []
    assert recover(path).restored == []


def test_a_damaged_chunk_is_left_out(tmp_path):
    path = write_rosbag1(tmp_path / "lab.bag", sample_messages(100), chunk=SMALL)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"compression=none", b"compression=rot1", 1))
    report = recover(path, tmp_path / "out")
    assert (report.damaged, report.restored) == (1, [tmp_path / "out" / "lab.bag"])
    assert 0 < report.messages < 100
    assert len(payloads(report.restored[0])) == report.messages
    assert path.read_bytes() != content


def test_what_cannot_be_restored_is_refused_and_left_alone(tmp_path):
    path = write_rosbag1(tmp_path / "lab.bag", clock_messages([1]))
    content = path.read_bytes()
    path.write_bytes(content[: content.index(b"compression=")])
    with pytest.raises(InputError, match="holds no whole chunk, allowed: at least one"):
        recover(path)
    assert [each.name for each in tmp_path.iterdir()] == ["lab.bag"]
    path.write_bytes(content[:-50])
    (tmp_path / "lab.bag.broken").touch()
    with pytest.raises(InputError, match=r"lab.bag.broken: already exists, allowed: move it"):
        recover(path)


def test_an_open_bag_says_what_follows_its_messages(tmp_path):
    whole = write_rosbag1(tmp_path / "whole.bag", clock_messages([5, 6, 7]))
    path = never_closed(tmp_path / "lab.bag", whole.read_bytes(), cut=False)
    with open_bag(path) as bag:
        (fault,) = bag.faults
        assert [message.log_ns for message in bag.messages()] == [5, 6]
    assert "was not closed: 1 chunks with 2 messages are read, " in fault
    assert not fault.endswith(" 0 bytes after them left out")
