"""A process that gives way to others of its run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cspm_ros.processes.background import put_behind

_TELL = """
import json, os, threading
from pathlib import Path

over = threading.Event()
threading.Thread(target=over.wait).start()
print("begun", flush=True)
input()
threading.Thread(target=over.wait).start()
group = Path("/proc/self/autogroup")
threads = [
    (os.sched_getscheduler(int(task)), os.getpriority(os.PRIO_PROCESS, int(task)))
    for task in sorted(os.listdir("/proc/self/task"))
]
print(json.dumps([threads, group.read_text().split()[-1] if group.exists() else ""]))
over.set()
"""
needs_linux = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="threads have no priority of their own here"
)


def run(*before):
    """Return policy and niceness of each thread, and niceness of the session, once put behind."""
    with subprocess.Popen(
        [*before, sys.executable, "-c", _TELL],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout.readline() == "begun\n"
        put_behind(process.pid)
        out, _ = process.communicate("go\n", timeout=60)
    return json.loads(out)


@needs_linux
def test_its_threads_preempt_nobody():
    threads, group = run()
    mine = os.getpriority(os.PRIO_PROCESS, 0)
    assert threads == [[os.SCHED_BATCH, max(10, mine)]] * 3
    assert group in ("", "10")


@needs_linux
def test_who_was_behind_already_stays_there():
    threads, _ = run("nice", "-n", "19")
    assert threads == [[os.SCHED_BATCH, 19]] * 3


def test_who_is_gone_needs_no_place():
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    put_behind(process.pid)
