"""One node as a program of its own, set by ROS 2 parameters."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.graph import NODES, PLAYER, VIEWER
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    MOTION_CONTROLLER,
    PLANT,
    TARGET_TRACKER,
    TENSION_DISTRIBUTION,
    WAVE_TRAJECTORY,
)
from cspm_ros.runtime.ros_install import find_ros

ROS_ARGS = "--ros-args"
INTERRUPTED = 130
_HELP = """usage: {name} [--ros-args -p PARAMETER:=VALUE … --params-file FILE -r OLD:=NEW …]

The node {name} of cspm. Parameters: scenario (a name or a file), pace (lockstep or realtime),
nodes (which take part) and more: `ros2 param describe /{name} NAME` explains each."""


def start_node(
    name: str,
    args: Sequence[str],
    began: float | None = None,
    failed: Callable[[CspmError], None] = lambda _: None,
) -> Path | None:
    """Run a node until its run ends or a signal comes; return what a recorder has recorded.

    Args:
        name: one of `NODES`.
        args: what follows the name on the command line, such as `--ros-args -p scenario:=calm`.
        began: when starting began, on `time.perf_counter` [s]; None: now.
        failed: called with a failure of the run before the node leaves the graph.

    Raises:
        InputError: no such node, no ROS, or arguments that cannot be used.
        CspmError: the run failed.
    """
    began = time.perf_counter() if began is None else began
    if name not in NODES:
        raise InputError(f"node {name}: allowed: {', '.join(NODES)}")
    if args and args[0] != ROS_ARGS:
        raise InputError(
            f"node {name}: {args[0]}, allowed: nothing, or {ROS_ARGS} and what ROS 2 takes after it"
        )
    find_ros(f"node {name}")
    # Loading ROS comes after looking for it.
    from cspm_ros.runtime.node_run import run_node

    return run_node(name, [name, *args], began, failed)


def main(
    name: str,
    args: Sequence[str],
    began: float | None = None,
    finish: Callable[[Path], None] = lambda _: None,
) -> int:
    """Run a node as a program; return its exit code, errors as one line on stderr.

    Args:
        name: one of `NODES`.
        args: as for `start_node`.
        began: as for `start_node`.
        finish: called with what a recorder has recorded.
    """
    if {"--help", "-h"} & set(args):
        print(_HELP.format(name=name))  # noqa: T201 - the program's voice
        return 0
    said: list[CspmError] = []

    def say(err: CspmError) -> None:
        line = " ".join(err.line.split()).removeprefix(f"node {name}: ")
        print(f"cspm node {name}: {line}", file=sys.stderr, flush=True)  # noqa: T201
        said.append(err)

    try:
        if (recorded := start_node(name, args, began, say)) is not None:
            finish(recorded)
    except CspmError as err:
        if err not in said:
            say(err)
        return err.exit_code
    except KeyboardInterrupt:
        # Before the node takes signals itself.
        return INTERRUPTED
    return 0


def plant() -> None:
    """Run the plant."""
    sys.exit(main(PLANT, sys.argv[1:]))


def wave_trajectory() -> None:
    """Run the wave trajectory."""
    sys.exit(main(WAVE_TRAJECTORY, sys.argv[1:]))


def target_tracker() -> None:
    """Run the target tracker."""
    sys.exit(main(TARGET_TRACKER, sys.argv[1:]))


def motion_controller() -> None:
    """Run the motion controller."""
    sys.exit(main(MOTION_CONTROLLER, sys.argv[1:]))


def tension_distribution() -> None:
    """Run the tension distribution."""
    sys.exit(main(TENSION_DISTRIBUTION, sys.argv[1:]))


def force_controller() -> None:
    """Run the force controller."""
    sys.exit(main(FORCE_CONTROLLER, sys.argv[1:]))


def player() -> None:
    """Run the player."""
    sys.exit(main(PLAYER, sys.argv[1:]))


def viewer() -> None:
    """Run the viewer's node."""
    sys.exit(main(VIEWER, sys.argv[1:]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
