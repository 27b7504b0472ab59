"""A process that loads once what all nodes need, and forks each of them."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from setproctitle import setproctitle

from cspm_msgs_py.garbage import look_seldom
from cspm_ros.processes.preload import preload
from cspm_ros.runtime.node_main import ROS_ARGS, main

# What the host says of a node, a line each: what, the node's name and a number.
STARTED, ENDED = "started", "ended"


def host(names: Sequence[str], parameters: str, log: Path, namespace: str) -> int:
    """Fork a process per node, and say on standard output how each of them ends.

    Nothing of ROS 2 may have started before: threads do not survive a fork.

    Args:
        names: of the nodes.
        parameters: file of ROS 2 parameters for all of them.
        log: folder for what they print.
        namespace: of all of them.
    """
    began = time.perf_counter()
    look_seldom()
    preload()
    running: dict[int, str] = {}
    for name in names:
        process = os.fork()
        if process == 0:
            args = [ROS_ARGS, "--params-file", parameters, "-r", f"__ns:={namespace}"]
            _become(name, args, log)
            return main(name, args, began)
        running[process] = name
        _say(STARTED, name, process)
    while running:
        process, status = os.wait()
        _say(ENDED, running.pop(process), os.waitstatus_to_exitcode(status))
    return 0


def _become(name: str, args: Sequence[str], log: Path) -> None:
    """Make this process look like a program of its own: session, output, title."""
    os.setsid()
    with (log / f"{name}.log").open("ab") as file:
        os.dup2(file.fileno(), sys.stdout.fileno())
        os.dup2(file.fileno(), sys.stderr.fileno())
    sys.argv = ["-m", "cspm_ros.runtime.node_main", name, *args]
    setproctitle(" ".join([sys.executable, *sys.argv]))


def _say(what: str, name: str, number: int) -> None:
    print(what, name, number, flush=True)  # noqa: T201 - read by who started the host


if __name__ == "__main__":
    sys.exit(host(sys.argv[4:], sys.argv[1], Path(sys.argv[2]), sys.argv[3]))
