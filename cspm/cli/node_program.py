"""A node of the graph as a program: what `cspm node NAME` and `ros2 run cspm recorder` start."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cspm_msgs_py.graph import RECORDER
from cspm_ros.runtime.node_main import main


def run_program(name: str, args: Sequence[str]) -> int:
    """Run a node as a program, errors as one line on stderr; return its exit code.

    Args:
        name: as for `cspm.graph.run_node`.
        args: as for `cspm.graph.run_node`.
    """
    return main(name, args, finish=_finish)


def recorder() -> None:
    """Run the recorder as a program, for `ros2 run`."""
    sys.exit(run_program(RECORDER, sys.argv[1:]))


def _finish(recorded: Path) -> None:
    """Put beside a recording what belongs there; only a recorder needs what this loads."""
    from cspm.summary_files import finish_recording

    finish_recording(recorded)
