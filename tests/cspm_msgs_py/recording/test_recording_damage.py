"""Damaged files: any cut and any flipped byte gives one line or the right rows, never a crash."""

import random

import numpy as np
import pytest
from recording_samples import TOPICS, write_sample

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.recording import Recording, first_difference, overview, recover

FEW = {name: TOPICS[name] for name in ("/clock", "/bar/pose", "/winches/state", "/diagnostics")}
NAMES = [name for name in FEW if name != "/diagnostics"]
STEPS = 130


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("damage") / "calm"
    rows = write_sample(folder, STEPS, topics=FEW)
    return (folder / "calm_0.mcap").read_bytes(), rows


def refused(use, *arguments):
    """Call; return whether it was refused with one line."""
    try:
        use(*arguments)
    except CspmError as err:
        return bool(str(err)) and "\n" not in str(err)
    return False


def read(path, rows):
    """Return the number of messages of the pose, None if refused; what is read must be right."""
    read_out = []

    def read_all():
        with Recording(path) as recording:
            found = recording.rows_of([n for n in NAMES if n in recording.topics])
            recording.payloads("/diagnostics")
            read_out.extend([recording.complete, recording.attachments, recording.metadata, found])

    if refused(read_all):
        return None
    complete, *_, found = read_out
    for name, topic_rows in found.items():
        count = len(topic_rows.log_ns)
        assert count == STEPS if complete else count <= STEPS
        expected = rows[name][:count] if count else topic_rows.rows
        np.testing.assert_array_equal(topic_rows.rows, expected)
    return len(found["/bar/pose"].log_ns) if "/bar/pose" in found else 0


def use_everything(path, out, whole):
    """Run all that a user may do with a file; only clear errors may come."""

    def compare():
        with Recording(path) as recording, Recording(whole) as other:
            first_difference(recording, other)

    return [refused(overview, path), refused(recover, path, out), refused(compare)]


def places(content, count, seed):
    rng = random.Random(seed)
    edges = [*range(0, 60), *range(len(content) - 60, len(content))]
    return sorted({*edges, *rng.sample(range(len(content)), count)})


@pytest.mark.slow
def test_a_cut_anywhere_leaves_what_is_before_it(tmp_path, sample):
    content, rows = sample
    path, whole = tmp_path / "cut.mcap", tmp_path / "whole.mcap"
    whole.write_bytes(content)
    counts = []
    for i, end in enumerate(places(content, 120, seed=1)):
        path.write_bytes(content[:end])
        counts.append(read(path, rows))
        if i % 6 == 0:
            use_everything(path, tmp_path / f"out{i}", whole)
    known = [count for count in counts if count is not None]
    assert known == sorted(known)
    assert {0, 50, 100, STEPS} <= set(known)
    assert counts[0] is None


@pytest.mark.slow
def test_a_flipped_byte_anywhere_gives_a_line_or_the_right_rows(tmp_path, sample):
    content, rows = sample
    path, whole = tmp_path / "flipped.mcap", tmp_path / "whole.mcap"
    whole.write_bytes(content)
    rng = random.Random(2)
    refused = 0
    for i, place in enumerate(places(content, 250, seed=3)):
        damaged = bytearray(content)
        damaged[place] ^= rng.choice([0xFF, 1 << rng.randrange(8)])
        path.write_bytes(damaged)
        refused += read(path, rows) is None
        if i % 6 == 0:
            use_everything(path, tmp_path / f"out{i}", whole)
    assert refused > 100


def test_a_damaged_chunk_is_named(tmp_path, sample):
    content, _ = sample
    with Recording(write(tmp_path / "a.mcap", content)) as recording:
        chunk = recording.files[0].chunks[1].record
    damaged = bytearray(content)
    damaged[chunk.end - 20] ^= 0x40
    with (
        Recording(write(tmp_path / "a.mcap", bytes(damaged))) as recording,
        pytest.raises(CspmError, match=rf"a.mcap: chunk at byte {chunk.offset}: "),
    ):
        recording.rows("/bar/pose")


def test_a_damaged_attachment_is_named(tmp_path, sample):
    content, _ = sample
    damaged = content.replace(b"name: calm\n", b"name: balm\n")
    with (
        Recording(write(tmp_path / "a.mcap", damaged)) as recording,
        pytest.raises(CspmError, match=r"attachment 'scenario.yaml' is damaged \(CRC\)$"),
    ):
        assert recording.attachments


def test_a_damaged_summary_is_said_and_recovered(tmp_path, sample):
    content, _ = sample
    damaged = bytearray(content)
    damaged[-100] ^= 1
    path = write(tmp_path / "a.mcap", bytes(damaged))
    with pytest.raises(CspmError, match=r"a.mcap: the summary's CRC does not fit$"):
        Recording(path)
    assert recover(path).counts["/bar/pose"] == STEPS
    with Recording(path) as recording, Recording(write(tmp_path / "b.mcap", content)) as other:
        assert first_difference(recording, other) is None


def write(path, content):
    path.write_bytes(content)
    return path
