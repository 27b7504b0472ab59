"""The command `cspm check-drivers`: listens to drivers and reports what is wrong."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from cspm.drivers import DriverReport, Machine, listened, listener_to
from cspm_msgs_py.errors import InputError
from cspm_ros.check_drivers.driver_report import count_line, drivers_console, topic_table
from cspm_ros.check_drivers.guided_pull import GuidedPull, pulled_cables
from cspm_ros.check_drivers.time_bar import time_bar
from cspm_ros.replay.terminal_keys import TerminalKeys
from cspm_run.output.console import say
from cspm_run.output.json_file import write_json

if TYPE_CHECKING:
    from cspm_ros.check_drivers.driver_listener import DriverListener


def check_drivers_command(
    machine: Machine,
    seconds: float,
    *,
    sim_time: bool = False,
    pull: str | None = None,
    json: Path | None = None,
) -> bool:
    """Listen to drivers, print the findings, and return whether all was received without fault.

    Args:
        machine: what the drivers are checked against.
        seconds: duration of listening and of each pull [s].
        sim_time: whether stamps follow `/clock`.
        pull: cables to pull at, names with commas or `all`; None for no pull test.
        json: file to write all findings to.

    Raises:
        InputError: an option is not possible.
    """
    cables = () if pull is None else pulled_cables(pull, machine.testbed)
    keys = _keys() if cables else None
    console = drivers_console()
    with listener_to(machine, seconds, sim_time=sim_time) as listener:
        found = _listen(machine, listener, seconds, console)
        if keys is not None and found.complete and found.heard:
            with keys:
                guide = GuidedPull(machine.testbed, listener, keys, console, seconds)
                pulls = guide.run(cables)
            found = replace(found, pulls=pulls, complete=pulls.complete)
    if not found.complete:
        say(console, "ended early")
    if json is not None:
        write_json(json, found.data())
    return found.ok and found.complete


def _listen(
    machine: Machine, listener: DriverListener, seconds: float, console: Console
) -> DriverReport:
    with time_bar(console, "", seconds) as show:
        found = listened(
            machine, listener, seconds, lambda share, what: show(share * seconds, what)
        )
    console.print(topic_table(f"drivers of {machine.testbed.name}", found.topics))
    say(console, count_line(found.topics))
    if not found.heard:
        say(console, _where())
    return found


def _where() -> str:
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    reach = os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"]
    return (
        f"nothing was heard on ROS_DOMAIN_ID {domain}, ROS_AUTOMATIC_DISCOVERY_RANGE {reach}: are"
        " the drivers on, on this domain, and on this computer unless the range is SUBNET?"
    )


def _keys() -> TerminalKeys:
    keys = TerminalKeys()
    if not keys.usable:
        raise InputError("--pull: standard input is no terminal, allowed: one, for its Enter key")
    return keys
