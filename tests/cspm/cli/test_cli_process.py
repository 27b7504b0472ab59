"""The command line as a process: interrupted, killed, without room."""

import json
import os
import resource
import signal

import pytest
from cspm_process import child, grown
from error_lines import said

from cspm_msgs_py.recording import overview


def done(*arguments):
    """Run a command to its end; return exit code, stdout and stderr."""
    process = child(*arguments)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.mark.compiled
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_interrupting_leaves_a_complete_recording(tmp_path, number):
    folder = tmp_path / "bag"
    process = child("run", "rest", "--duration", "3600", "--out", folder)
    try:
        grown(process, folder, 400_000)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, err) == (1, "")
    assert "interrupted after " in out
    assert "the recording is complete so far" in out
    assert overview(folder).complete
    summary = json.loads((folder / "summary.json").read_text())
    assert 0.0 < summary["duration_s"] < 3600.0
    assert summary["messages"]["/clock"] == round(summary["duration_s"] * 1000)
    code, out, _ = done("resim", folder)
    assert code == 0
    total = sum(summary["messages"].values())
    assert out.splitlines()[-1] == f"identical: all {total} messages, bit for bit"


def limited():
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))


@pytest.mark.compiled
def test_a_full_disk_is_one_line(tmp_path):
    folder = tmp_path / "bag"
    process = child("run", "rest", "--out", folder, preexec_fn=limited)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said(err) == f"{folder}/bag_0.mcap: recording failed (File too large)\n"
    assert overview(folder).message_count > 0


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("size", [53_000, 1_234_567])
def test_a_killed_run_is_recovered_and_repeats_itself(tmp_path, size):
    folder = tmp_path / "bag"
    process = child("run", "worst_case", "--out", folder)
    try:
        grown(process, folder, size)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert not overview(folder).complete
    assert done("recover", folder)[0] == 0
    assert overview(folder).complete
    code, out, err = done("resim", folder)
    assert (code, err) == (0, "")
    # Before it stands what the work has reached, if it takes longer.
    assert out.splitlines()[-1].startswith("identical: all ")


@pytest.mark.slow
@pytest.mark.compiled
def test_output_may_end_early():
    """`cspm info | head -1` is no error."""
    process = child("run", "--help", env=os.environ | {"PYTHONUNBUFFERED": "1"})
    process.stdout.close()
    err = process.stderr.read()
    process.wait(60)
    process.stderr.close()
    assert "Traceback" not in err
