"""What of a recording does not fit what it states about its run."""

from hashlib import sha256

import pytest
from recording_samples import TOPICS

from cspm_msgs_py.recording import RecordingWriter, overview

TESTBED, MAPPING = b"name: rig\n", b"format: csv\n"


def recorded(folder, attachments, **record):
    sums = {"testbed_sha256": TESTBED, "mapping_sha256": MAPPING}
    sums = {key: sha256(text).hexdigest() for key, text in sums.items()}
    with RecordingWriter(folder, TOPICS, attachments=attachments, metadata=sums | record):
        pass
    return folder


def test_a_recording_as_it_was_written_fits(tmp_path):
    whole = {"testbed.yaml": TESTBED, "mapping.yaml": MAPPING}
    for i, attachments in enumerate([whole, {}]):
        assert overview(recorded(tmp_path / str(i), attachments)).misfits == []


@pytest.mark.parametrize("name", ["testbed.yaml", "mapping.yaml"])
def test_an_exchanged_attachment_is_named(cspm, tmp_path, name):
    path = recorded(
        tmp_path / "bag", {"testbed.yaml": TESTBED, "mapping.yaml": MAPPING} | {name: b"name: x"}
    )
    (line,) = overview(path).misfits
    assert line.startswith(f"{name} has SHA-256 {sha256(b'name: x').hexdigest()}, but ")
    assert line.endswith(": exchanged or edited")
    assert f"does not fit: {name} has SHA-256" in " ".join(cspm("info", "bag")[1].split())


def test_another_contract_version_is_named(tmp_path):
    path = recorded(tmp_path / "bag", {}, contract_version="2")
    assert overview(path).misfits == [
        "contract version 2, this cspm has 1: names and units may mean something else"
    ]
    assert overview(recorded(tmp_path / "own", {}, contract_version="1")).misfits == []
