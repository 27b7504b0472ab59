"""Damage that all commands report alike: never closed, holes, killed splits, missing metadata."""

import shutil
import subprocess
import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import zstandard
from import_samples import imported
from lab_bags import EPOCH_NS, STEP_NS, bag, joints
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from cspm_msgs_py.bag import open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import overview, recover
from cspm_msgs_py.yaml_file import dump_yaml

COUNT, TOPIC = 300, "/js"
MAPPING = """
name: rig
channels:
  /winches/state: {position/surge: {column: '/js:position[surge]', unit: rad}}
"""


def messages(first=0, last=COUNT):
    rng = np.random.default_rng(first)
    for i in range(first, last):
        stamp = EPOCH_NS + i * STEP_NS
        yield stamp, TOPIC, joints(stamp, ["surge"], [0.01 * i + 1e-3 * rng.normal()])


def whole(path, first=0, last=COUNT):
    return bag(path, messages(first, last), chunk=3000, compression=CompressionType.ZSTD)


def chunks_of(path):
    """Offsets of the chunks' data, by the reader of `mcap`."""
    with path.open("rb") as file:
        return make_reader(file).get_summary().chunk_indexes


def holed(path):
    whole(path)
    content = bytearray(path.read_bytes())
    index = chunks_of(path)[1]
    middle = index.chunk_start_offset + index.chunk_length // 2
    content[middle : middle + 64] = bytes(64)
    path.write_bytes(content)
    lost = _messages_in(path.read_bytes(), index)
    return path, lost


def _messages_in(content, index):
    return sum(1 for log in _times() if index.message_start_time <= log <= index.message_end_time)


def _times():
    return (EPOCH_NS + i * STEP_NS for i in range(COUNT))


def cut(path):
    whole(path)
    third = chunks_of(path)[2]
    content = path.read_bytes()[: third.chunk_start_offset + 40]
    path.write_bytes(content)
    return path


def read(path):
    return imported(path, MAPPING)


def test_a_bag_that_was_not_closed_says_so_everywhere(tmp_path):
    path = cut(tmp_path / "cut.mcap")
    found = read(path)
    count = len(found.stamps["/winches/state"])
    assert 0 < count < COUNT
    assert (
        f"{path}: not closed by its writer, read as far as it goes; `cspm recover`"
        in (found.report.notes[0])
    )
    shown = overview(path)
    assert (shown.complete, shown.message_count) == (False, count)
    report = recover(path, tmp_path / "out")
    assert report.messages == count
    assert read(tmp_path / "out").report.notes == []


def test_a_hole_in_a_closed_bag_is_left_out_and_counted_everywhere(tmp_path):
    path, lost = holed(tmp_path / "hole.mcap")
    found = read(path)
    assert len(found.stamps["/winches/state"]) == COUNT - lost
    assert f"{TOPIC}: {lost} messages are in what is damaged" in found.report.notes
    assert any("chunk at byte" in note for note in found.report.notes)
    shown = overview(path)
    assert shown.message_count == COUNT - lost
    assert len(shown.faults) == 1
    with pytest.raises(InputError, match="chunk at byte"), open_bag(path) as stream:
        list(stream.messages())
    report = recover(path, tmp_path / "out")
    assert (report.damaged, report.messages) == (1, COUNT - lost)
    assert overview(tmp_path / "out").faults == []
    again = recover(tmp_path / "out")
    assert (again.restored, again.described) == ([], False)
    in_place = recover(path)
    assert in_place.restored == [path]
    assert len(read(path).stamps["/winches/state"]) == COUNT - lost


def test_a_bag_without_fault_has_none(tmp_path):
    path = whole(tmp_path / "a.mcap")
    assert read(path).report.notes == []
    assert overview(path).faults == []
    assert recover(path).restored == []


def begun(content):
    """The magic and the header of a file, as a writer leaves it that is killed at once."""
    length = int.from_bytes(content[9:17], "little")
    return content[: 17 + length]


def splits(folder):
    """Splits 1, 2 and 10 of a recorder that was killed when it had begun the next."""
    folder.mkdir()
    for number, first in ((2, 100), (1, 0), (10, 200)):
        whole(folder / f"s_{number}.mcap", first, first + 100)
    (folder / "s_11.mcap").write_bytes(begun((folder / "s_1.mcap").read_bytes()))
    return folder


def test_splits_without_metadata_are_read_by_their_numbers(tmp_path):
    folder = splits(tmp_path / "lab")
    found = read(folder)
    assert len(found.stamps["/winches/state"]) == COUNT
    assert found.report.notes == [
        f"{folder}: metadata.yaml is missing, its 4 files are read by the numbers in their names;"
        " `cspm recover` writes it",
        f"{folder}/s_11.mcap: not closed, and holds no channel and no message: left out",
    ]
    shown = overview(folder)
    assert (shown.complete, shown.message_count, len(shown.faults)) == (False, COUNT, 2)
    report = recover(folder)
    assert (report.restored, report.bare) == ([], [folder / "s_11.mcap"])
    assert (report.messages, report.described) == (COUNT, True)
    assert overview(folder).faults == []
    assert read(folder).report.notes == []


def test_files_that_all_hold_nothing_are_refused(tmp_path):
    folder = tmp_path / "lab"
    folder.mkdir()
    content = begun(whole(tmp_path / "a.mcap").read_bytes())
    (folder / "a_0.mcap").write_bytes(content[:20])
    (folder / "a_1.mcap").write_bytes(content)
    for command in (overview, recover, read):
        with pytest.raises(InputError, match=r"not closed, and holds no ch|ends before its header"):
            command(folder)


def metadata(files, **changes):
    """The metadata that rosbag2 writes, with changes."""
    about = {
        "version": 9,
        "storage_identifier": "mcap",
        "message_count": COUNT,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": files,
    }
    return dump_yaml({"rosbag2_bagfile_information": about | changes})


def test_an_empty_storage_identifier_is_taken_from_the_files(tmp_path):
    folder = tmp_path / "lab"
    folder.mkdir()
    whole(folder / "a_0.mcap")
    (folder / "metadata.yaml").write_text(metadata(["a_0.mcap"], storage_identifier=""))
    found = read(folder)
    assert len(found.stamps["/winches/state"]) == COUNT
    assert "names no storage_identifier" in found.report.notes[0]
    assert len(overview(folder).faults) == 1
    assert recover(folder).described
    assert overview(folder).faults == []


def packed(folder):
    """A bag whose messages are compressed one by one, as rosbag2 does."""
    folder.mkdir()
    source = whole(folder / "source.mcap")
    compressor = zstandard.ZstdCompressor()
    rewritten = folder / "m_0.mcap"
    with source.open("rb") as file, rewritten.open("wb") as target:
        writer = Writer(target, compression=CompressionType.NONE)
        writer.start(profile="ros2")
        sender = None
        for schema, channel, message in make_reader(file).iter_messages():
            if sender is None:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                sender = writer.register_channel(channel.topic, "cdr", number)
            writer.add_message(
                sender, message.log_time, compressor.compress(message.data), message.log_time
            )
        writer.finish()
    source.unlink()
    return folder


def test_messages_compressed_one_by_one_are_read_with_metadata_and_without(tmp_path):
    folder = packed(tmp_path / "lab")
    assert len(read(folder).stamps["/winches/state"]) == COUNT
    said = metadata(["m_0.mcap"], compression_format="zstd", compression_mode="MESSAGE")
    (folder / "metadata.yaml").write_text(said)
    assert len(read(folder).stamps["/winches/state"]) == COUNT
    assert overview(folder).message_count == COUNT
    report = recover(folder, tmp_path / "out")
    assert report.messages == COUNT
    assert len(read(tmp_path / "out").stamps["/winches/state"]) == COUNT


@pytest.mark.skipif(find_spec("pymcap_cli") is None, reason="pymcap-cli is not installed")
@pytest.mark.parametrize("kind", ["cut", "hole", "whole"])
def test_what_is_recovered_is_what_another_recoverer_finds(tmp_path, kind):
    path = tmp_path / "a.mcap"
    {"cut": cut, "hole": holed, "whole": whole}[kind](path)
    mine = tmp_path / "mine.mcap"
    shutil.copy(path, mine)
    recover(mine)
    theirs = tmp_path / "theirs.mcap"
    run = "import sys; from pymcap_cli.cli import main; sys.exit(main())"
    # Without that it copies chunks unseen, damaged ones too.
    options = ["recover", str(path), "-o", str(theirs), "--always-decode-chunk"]
    command = [sys.executable, "-c", run, *options]
    subprocess.run(command, check=False, capture_output=True, timeout=120)
    # It writes the messages of a chunk that is cut twice.
    assert set(_logs(mine)) == set(_logs(theirs))
    assert set(_logs(mine).values()) == {1}


def _logs(path: Path):
    with path.open("rb") as file:
        return Counter(message.log_time for _, _, message in make_reader(file).iter_messages())


def test_the_damaged_chunk_is_one_of_several(tmp_path):
    path, lost = holed(tmp_path / "hole.mcap")
    with path.open("rb") as file:
        chunks = [r for r in StreamReader(file, emit_chunks=True).records if isinstance(r, Chunk)]
    assert len(chunks) > 3
    assert 0 < lost < COUNT / 2
