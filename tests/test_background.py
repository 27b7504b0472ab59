"""A process that gives way to others of its run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

_TELL = """
import json, os, threading
from pathlib import Path
from cspm_bringup.background import give_way

def told():
    group = Path("/proc/self/autogroup")
    nice = group.read_text().split()[-1] if group.exists() else ""
    return [
        (os.sched_getscheduler(int(task)), os.getpriority(os.PRIO_PROCESS, int(task)))
        for task in sorted(os.listdir("/proc/self/task"))
    ], nice

over = threading.Event()
threading.Thread(target=over.wait).start()
{before}
give_way()
threading.Thread(target=over.wait).start()
print(json.dumps(told()))
over.set()
"""
needs_linux = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="threads have no priority of their own here"
)


def run(before=""):
    done = subprocess.run(
        [sys.executable, "-c", _TELL.format(before=before)],
        capture_output=True,
        text=True,
        check=True,
        start_new_session=True,
        timeout=60,
    )
    return json.loads(done.stdout)


@needs_linux
def test_threads_of_before_and_after_preempt_nobody():
    threads, group = run()
    mine = os.getpriority(os.PRIO_PROCESS, 0)
    assert threads == [[os.SCHED_BATCH, max(10, mine)]] * 3
    assert group in ("", "10")


@needs_linux
def test_who_was_behind_already_stays_there():
    threads, _ = run(before="os.nice(19)")
    # On Linux that is the main thread, and what it starts from then on.
    nices = [nice for _, nice in threads]
    assert nices[0] == nices[2] == 19 > nices[1]
