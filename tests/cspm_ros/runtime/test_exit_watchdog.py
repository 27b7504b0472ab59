"""A process that cannot leave is ended; one that can is not."""

import os
import signal
import subprocess
import sys

from ros_graph import load_ros, new_domain

# `PyDLL` keeps Python's lock, as the middleware does when it waits for itself.
_PROGRAM = """
import ctypes, time
from cspm_ros.runtime.exit_watchdog import exit_watchdog
with exit_watchdog() as begin:
    {inside}
{after}
"""
# A node that cannot use its parameters, and whose middleware never lets it go.
_NODE = """
import ctypes, sys
from cspm_ros.runtime import node_run
from cspm_ros.runtime.node_main import main
class Stuck(node_run.Session):
    def __exit__(self, *_):
        ctypes.PyDLL(None).sleep(600)
node_run.Session, node_run._LEAVING_S = Stuck, 0.2
sys.exit(main("plant", ["--ros-args", "-p", "scenario:=nowhere"]))
"""
STUCK = "ctypes.PyDLL(None).sleep(600)"
LONGER = "time.sleep(0.6)"


def code_of(inside, after=""):
    program = _PROGRAM.format(inside=inside, after=after)
    return subprocess.run([sys.executable, "-c", program], check=False, timeout=60).returncode


def test_the_system_ends_who_is_stuck_with_pythons_lock():
    assert code_of(f"begin(0.2, False); {STUCK}") == -signal.SIGALRM


def test_a_failure_stays_a_failure():
    assert code_of(f"begin(0.2, True); {STUCK}") == 1


def test_before_it_begins_there_is_time():
    assert code_of(LONGER) == 0


def test_who_has_left_is_not_ended():
    for failed in (False, True):
        assert code_of(f"begin(0.2, {failed})", after=LONGER) == 0


def test_a_node_that_is_stuck_has_said_why_it_failed():
    load_ros()
    environment = os.environ | {"ROS_DOMAIN_ID": str(new_domain())}
    command = [sys.executable, "-c", _NODE]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("cspm node plant: nowhere: no such scenario, allowed: ")
