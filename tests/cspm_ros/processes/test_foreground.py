"""A process that goes before others, where the system permits it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

_TELL = """
import json, os, threading
from cspm_ros.processes.foreground import put_ahead

over = threading.Event()
threading.Thread(target=over.wait).start()
refused = put_ahead({priority})
threading.Thread(target=over.wait).start()
tasks = sorted(map(int, os.listdir("/proc/self/task")))
threads = [(os.sched_getscheduler(t), os.sched_getparam(t).sched_priority) for t in tasks]
status = open("/proc/self/status").read()
print(json.dumps([refused, threads, os.SCHED_FIFO, status.split("VmLck:")[1].split()[0]]))
over.set()
"""
pytestmark = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="threads have no priority of their own here"
)


def run(priority, *before):
    command = [*before, sys.executable, "-c", _TELL.format(priority=priority)]
    return json.loads(subprocess.run(command, capture_output=True, check=True, timeout=60).stdout)


def test_all_its_threads_have_the_priority_or_it_says_why_not():
    refused, threads, fifo, locked = run(42)
    if "SCHED_FIFO" in refused:
        assert refused.startswith("SCHED_FIFO 42 (limit rtprio, or CAP_SYS_NICE)")
        assert all(policy != fifo for policy, _ in threads)
    else:
        assert threads == [[fifo, 42]] * len(threads)
        assert len(threads) >= 3
    assert ("locked memory (limit memlock" in refused) == (locked == "0")


def test_what_no_system_permits_is_refused():
    refused, threads, fifo, _ = run(100)
    assert refused.startswith("SCHED_FIFO 100 (limit rtprio, or CAP_SYS_NICE)")
    assert all(policy != fifo for policy, _ in threads)
