"""Recordings read by Foxglove's own libraries: an independent check of container and messages."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from recording_samples import ATTACHMENTS, METADATA, ROW_TOPICS, STEP_NS, write_sample

from cspm_msgs_py.recording import Recording, recover

NODE = Path(__file__).parent / "node"
STEPS = 230


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Return a function that reads a file with the npm packages, installed in a folder apart."""
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("node and npm are not installed")
    folder = tmp_path_factory.mktemp("node")
    for name in ("package.json", "read.mjs"):
        shutil.copy(NODE / name, folder)
    command = ["npm", "install", "--no-audit", "--no-fund", "--no-package-lock", "--ignore-scripts"]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=180)
    except subprocess.TimeoutExpired:
        pytest.skip("npm could not install the readers within 180 s")
    if done.returncode:
        pytest.skip(f"npm could not install the readers: {done.stderr.strip()[-200:]}")

    def run(path):
        command = ["node", "read.mjs", str(path)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def numbers(node):
    """Return the numbers of a decoded message in order, without its stamps and names."""
    if isinstance(node, dict):
        skipped = ("header", "clock", "name", "joint_names", "time_from_start")
        return [x for key, value in node.items() if key not in skipped for x in numbers(value)]
    if isinstance(node, list):
        return [x for value in node for x in numbers(value)]
    return [node]


@pytest.mark.slow
def test_foxglove_reads_every_topic(tmp_path, read):
    rows = write_sample(tmp_path / "calm", STEPS, start_ns=10**9)
    found = read(tmp_path / "calm" / "calm_0.mcap")
    assert found["profile"] == "ros2"
    assert found["attachments"] == {name: text.decode() for name, text in ATTACHMENTS.items()}
    assert found["metadata"]["cspm"] == METADATA
    for name, topic in ROW_TOPICS.items():
        messages = found["topics"][name]
        assert (messages["count"], messages["logTime"]) == (STEPS, str(10**9))
        assert numbers(messages["first"]) == rows[name][0].tolist()
        assert numbers(messages["last"]) == rows[name][-1].tolist()
        first, last = (
            messages[which]["clock" if name == "/clock" else "header"]
            for which in ("first", "last")
        )
        stamp, end = (first, last) if name == "/clock" else (first["stamp"], last["stamp"])
        assert (stamp["sec"], stamp.get("nanosec", stamp.get("nsec"))) == (0, 999_999_500)
        expected = (STEPS - 1) * STEP_NS - 500
        assert (end["sec"], end.get("nanosec", end.get("nsec"))) == (1, expected)
        if name != "/clock":
            assert first["frame_id"] == topic.frame_id
        if topic.joint_names:
            names = messages["first"].get("name", messages["first"].get("joint_names"))
            assert tuple(names) == topic.joint_names
    diagnostics = found["topics"]["/diagnostics"]
    assert diagnostics["count"] == STEPS // 10
    assert diagnostics["last"]["status"][0] == {
        "level": 1,
        "name": "cables/sway_1",
        "message": "slack",
        "hardware_id": "",
        "values": [{"key": "step", "value": "220"}],
    }


@pytest.mark.slow
def test_foxglove_reads_a_recovered_recording(tmp_path, read):
    write_sample(tmp_path / "calm", STEPS)
    path = tmp_path / "calm" / "calm_0.mcap"
    with Recording(path) as recording:
        end = recording.files[0].chunks[2].index_end
    path.write_bytes(path.read_bytes()[: end + 50])
    report = recover(tmp_path / "calm")
    found = read(path)["topics"]
    assert {name: topic["count"] for name, topic in found.items()} == report.counts
