"""A recording whose process is killed loses at most 0.2 s of log time."""

import mmap
import random
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from recording_child import NAMES
from recording_samples import ATTACHMENTS, METADATA, STEP_NS
from rosbags.highlevel import AnyReader

from cspm_msgs_py.recording import Recording, overview, recover

CHILD = Path(__file__).resolve().parents[2] / "support" / "recording_child.py"
LARGEST_LOSS_NS = 200_000_000
MOMENTS = random.Random(20).sample(range(1, 20_000), 6)


def record_until_killed(folder, progress_path, steps):
    """Kill the recording child once it has begun `steps` steps; return the last one reported."""
    progress_path.write_bytes(bytes(8))
    with progress_path.open("r+b") as file, mmap.mmap(file.fileno(), 8) as shared:
        child = subprocess.Popen([sys.executable, CHILD, folder, progress_path])
        try:
            limit = time.monotonic() + 60
            while struct.unpack_from("<q", shared)[0] < steps * STEP_NS:
                assert child.poll() is None
                assert time.monotonic() < limit
        finally:
            child.send_signal(signal.SIGKILL)
            child.wait()
        return struct.unpack_from("<q", shared)[0]


@pytest.mark.slow
@pytest.mark.parametrize("steps", MOMENTS)
def test_at_most_a_fifth_of_a_second_is_lost(tmp_path, steps):
    folder = tmp_path / "killed"
    told_ns = record_until_killed(folder, tmp_path / "progress", steps)
    with Recording(folder) as recording:
        assert not recording.complete
        before = recording.rows_of(NAMES)
    assert not overview(folder).complete
    report = recover(folder)
    assert report.end_ns >= told_ns - LARGEST_LOSS_NS
    with Recording(folder) as recording:
        assert recording.complete
        assert recording.attachments == ATTACHMENTS
        assert recording.metadata["cspm"] == METADATA
        after = recording.rows_of(NAMES)
    for name in NAMES:
        logs = after[name].log_ns
        np.testing.assert_array_equal(logs, np.arange(len(logs)) * STEP_NS)
        np.testing.assert_array_equal(after[name].stamp_ns, logs)
        assert (after[name].rows == np.arange(len(logs))[:, None]).all()
        assert len(before[name].log_ns) <= len(logs)
    with AnyReader([folder]) as bag:
        assert bag.message_count == report.messages == sum(len(r.log_ns) for r in after.values())
