"""Messages whose log time no clock can show: left out and counted by all that read MCAP."""

import numpy as np
import pytest
from bag_samples import CONTRACT, Written, write_mcap

from cspm_msgs_py.message import message_of
from cspm_msgs_py.recording import Recording, recover
from cspm_msgs_py.recording.log_time import LATEST_NS
from cspm_msgs_py.recording.mcap_file import McapFile
from cspm_msgs_py.recording.overview import overview

POSE = "/bar/pose"
LATE = {3: 2**63, 11: 2**64 - 1, 19: 2**64 - 10**9}
FORMS = {
    "closed": {},
    "one chunk a message": {"chunk": 1},
    "no index": {"indexed": False},
    "no chunks": {"chunked": False},
}


def poses(logs):
    pose = CONTRACT[POSE]
    row = np.r_[np.zeros(len(pose.fields) - 1), 1.0]
    return [Written(log, POSE, message_of(pose, i, row)) for i, log in enumerate(logs)]


def written(path, form, late):
    logs = [late.get(i, 10**9 + i) for i in range(20)]
    return write_mcap(path, poses(logs), **FORMS[form])


def cut(path):
    path.write_bytes(path.read_bytes()[:-40])
    return path


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_late_messages_are_left_out_and_counted(tmp_path, form, closed):
    path = written(tmp_path / "a.mcap", form, LATE)
    path = path if closed else cut(path)
    line = f"{path}: 3 messages logged later than {LATEST_NS} ns left out"
    with Recording(path) as recording:
        assert recording.topics[POSE].count == 17
        rows = recording.rows(POSE)
        assert rows.stamp_ns.tolist() == [i for i in range(20) if i not in LATE]
        assert (recording.start_ns, recording.end_ns) == (10**9, 10**9 + 18)
        assert recording.left_out == [line]
    found = overview(path)
    assert (found.message_count, found.end_ns) == (17, 10**9 + 18)
    assert line in found.faults


@pytest.mark.parametrize("form", FORMS)
def test_a_restored_recording_holds_them_no_longer(tmp_path, form):
    path = written(tmp_path / "a.mcap", form, LATE)
    report = recover(path, tmp_path / "out")
    assert report.messages == 17
    assert report.left_out == [f"{path}: 3 messages logged later than {LATEST_NS} ns left out"]
    with McapFile(report.restored[0], use_summary=False) as whole:
        contents = [whole.chunk_content(place) for place in whole.chunks]
        assert not whole.late
    assert not any(b"\xff" * 8 in content for content in contents)
    assert overview(report.path).faults == []


def test_times_that_are_possible_are_all_kept(tmp_path):
    path = written(tmp_path / "a.mcap", "closed", {19: LATEST_NS})
    with Recording(path) as recording:
        assert recording.left_out == []
        assert (recording.topics[POSE].count, recording.end_ns) == (20, LATEST_NS)
    assert recover(path).restored == []


@pytest.mark.parametrize("words", [["info"], ["recover"], ["export", "--out", "a.csv"]])
def test_the_commands_say_it(cspm, tmp_path, words):
    written(tmp_path / "a.mcap", "closed", LATE)
    code, out, err = cspm(words[0], "a.mcap", *words[1:])
    assert code == 0
    assert "a.mcap: 3 messages logged later than" in " ".join((out + err).split())
