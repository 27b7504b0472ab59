"""The command `cspm inject`: a fault into a run that is under way."""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.faults import KINDS, Fault
from cspm_msgs_py.yaml_file import validate
from cspm_ros.runtime.ros_install import find_ros
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

NODE_KILLED = "node_killed"


def inject_command(
    fault: str, on: str, amount: float | None, lasts: float | None, json: Path | None
) -> None:
    """Put a fault into the run in real time in this domain, and say so.

    Args:
        fault: one of `KINDS`, or `NODE_KILLED`.
        on: a measured topic, a cable or a node.
        amount: of the fault, where its kind has one.
        lasts: for how long [s]; None: to the end of the run.
        json: a file for what was done.

    Raises:
        InputError: no such fault, no run that takes it, or no ROS.
    """
    if fault not in (*KINDS, NODE_KILLED):
        raise InputError(f"{fault}: allowed: {', '.join((*KINDS, NODE_KILLED))}")
    find_ros("inject")
    # Loading ROS comes after looking for it.
    from cspm_ros.inject.injection import inject, kill_node

    if fault == NODE_KILLED:
        if amount is not None or lasts is not None:
            raise InputError(f"{NODE_KILLED}: with --amount or --for, allowed: --on NODE alone")
        text = f"{NODE_KILLED} on {on}: process {kill_node(on)}"
    else:
        given = {"fault": fault, "on": on, "amount": amount, "lasts": lasts}
        content = {key: value for key, value in given.items() if value not in (None, "")}
        made = validate(Fault, content, "inject")
        inject(made)
        text = str(made)
    say(make_console(), f"in the run: {text}")
    if json is not None:
        write_json(json, {"fault": fault, "on": on, "amount": amount, "lasts": lasts})
