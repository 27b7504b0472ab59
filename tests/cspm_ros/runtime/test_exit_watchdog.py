"""A process that cannot leave is ended; one that can is not."""

import signal
import subprocess
import sys

# `PyDLL` keeps Python's lock, as the middleware does when it waits for itself.
_PROGRAM = """
import ctypes, time
from cspm_ros.runtime.exit_watchdog import exit_watchdog
with exit_watchdog() as begin:
    {inside}
{after}
"""
STUCK = "ctypes.PyDLL(None).sleep(600)"
LONGER = "time.sleep(0.6)"


def code_of(inside, after=""):
    program = _PROGRAM.format(inside=inside, after=after)
    return subprocess.run([sys.executable, "-c", program], check=False, timeout=60).returncode


def test_the_system_ends_who_is_stuck_with_pythons_lock():
    assert code_of(f"begin(0.2); {STUCK}") == -signal.SIGALRM


def test_before_it_begins_there_is_time():
    assert code_of(LONGER) == 0


def test_who_has_left_is_not_ended():
    assert code_of("begin(0.2)", after=LONGER) == 0
