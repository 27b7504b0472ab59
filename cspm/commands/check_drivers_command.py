"""The command `cspm check-drivers`: listens to drivers and reports what is wrong."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import LockedWinches, Rates, Scenario, load_scenario, parse_scenario
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Finding, Observation
from cspm_ros.check_drivers.driver_report import (
    by_topic,
    count_line,
    drivers_console,
    findings_data,
    pulls_data,
    topic_table,
    topics_data,
)
from cspm_ros.check_drivers.guided_pull import GuidedPull, Pulls, pulled_cables
from cspm_ros.check_drivers.time_bar import time_bar
from cspm_ros.replay.terminal_keys import TerminalKeys
from cspm_ros.runtime.ros_install import find_ros
from cspm_run.console import say
from cspm_run.library import find_scenario
from cspm_run.summary import write_json
from cspm_sim.parameters import plant_parameters

if TYPE_CHECKING:
    from cspm_ros.check_drivers.driver_listener import DriverListener

SHORTEST_S, LONGEST_S = 1.0, 300.0


@dataclass(frozen=True)
class Machine:
    """The machine and scenario that the drivers are checked against.

    Attributes:
        testbed: the machine.
        scenario: what is to be run on it, with its rates and safe state.
    """

    testbed: Testbed
    scenario: Scenario

    @property
    def commanded(self) -> bool:
        """Whether the scenario commands torques."""
        return not isinstance(self.scenario.control, LockedWinches)

    @property
    def braked(self) -> bool:
        """Whether the scenario's safe state relies on brakes."""
        return self.scenario.safety.state == "brake"


@dataclass(frozen=True)
class Asked:
    """Options of the command.

    Attributes:
        machine: what the drivers are checked against.
        seconds: duration of listening and of each pull [s].
        sim_time: whether stamps follow `/clock`.
        pull: cables to pull at, names with commas or `all`; None for no pull test.
    """

    machine: Machine
    seconds: float
    sim_time: bool = False
    pull: str | None = None


@dataclass(frozen=True)
class Heard:
    """Results of listening.

    Attributes:
        topics: findings by topic.
        observations: what was received.
        pulls: what the pull test showed, where there was one.
        complete: whether it was not ended early.
    """

    topics: dict[str, list[Finding]]
    observations: list[Observation]
    pulls: Pulls | None
    complete: bool

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        fine = all(each.ok is not False for findings in self.topics.values() for each in findings)
        return fine and (self.pulls is None or self.pulls.ok)


def machine_of(
    testbed: Path | None, scenario: str | None, overrides: Sequence[str] = ()
) -> Machine:
    """Return the machine of a scenario, or of a test-bed file alone.

    With a test-bed file alone, the rates are those of a scenario without `rates`, or its sensors'
    where lower.

    Raises:
        InputError: none or both are given, or the file cannot be used.
    """
    if (testbed is None) == (scenario is None):
        raise InputError("check-drivers: allowed: --testbed FILE or --scenario NAME, one of both")
    if scenario is not None:
        path = find_scenario(scenario)
        found = load_scenario(path, overrides)
        testbed = path.parent / found.testbed
        return Machine(_testbed(testbed), found)
    assert testbed is not None
    machine = _testbed(testbed)
    rates = Rates().model_dump()
    for name, sensor in machine.sensors.items():
        key = RATE_OF_SENSOR[name]
        rates[key] = min(rates[key], sensor.rate)
    content = {"name": machine.name, "testbed": str(testbed), "duration": 1.0, "rates": rates}
    return Machine(machine, parse_scenario(dump_yaml(content), str(testbed), overrides))


def check_drivers_command(asked: Asked, json: Path | None = None) -> bool:
    """Listen to drivers, print the findings, and return whether all was received without fault.

    Raises:
        InputError: an option is not possible.
    """
    if not SHORTEST_S <= asked.seconds <= LONGEST_S:
        raise InputError(f"--for {asked.seconds:g}: allowed: {SHORTEST_S:g} to {LONGEST_S:g} s")
    testbed = asked.machine.testbed
    cables = () if asked.pull is None else pulled_cables(asked.pull, testbed)
    keys = _keys() if cables else None
    find_ros("check-drivers")
    # Loading ROS comes after looking for it.
    from cspm_msgs_py.ros.session import Session
    from cspm_ros.check_drivers.driver_listener import DriverListener

    console = drivers_console()
    with ExitStack() as stack:
        session = stack.enter_context(Session())
        listener = DriverListener(session, testbed, sim_time=asked.sim_time)
        found = _listen(asked, listener, console)
        if keys is not None and found.complete and _anything(found):
            stack.enter_context(keys)
            guide = GuidedPull(testbed, listener, keys, console, asked.seconds)
            pulls = guide.run(cables)
            found = Heard(found.topics, found.observations, pulls, pulls.complete)
    if not found.complete:
        say(console, "ended early")
    if json is not None:
        write_json(json, drivers_data(asked, found))
    return found.ok and found.complete


def drivers_data(asked: Asked, found: Heard) -> dict[str, Any]:
    """Return what the command prints, as plain data."""
    reported = {
        "testbed": asked.machine.testbed.name,
        "scenario": asked.machine.scenario.name,
        "seconds": asked.seconds,
        "complete": found.complete,
        "ok": found.ok,
        "topics": topics_data(found.topics, found.observations),
    }
    if found.pulls is None:
        return reported
    pulls = pulls_data(found.pulls.verdicts)
    return reported | {"pulls": pulls, "swapped": findings_data(found.pulls.swapped)}


def _listen(asked: Asked, listener: DriverListener, console: Console) -> Heard:
    machine, seconds = asked.machine, asked.seconds
    with console.status("looking for drivers"):
        there = listener.find()
    with time_bar(console, f"listening to {machine.testbed.name}", seconds) as show:
        complete = listener.listen(seconds, show) if there else True
    observations = listener.observations()
    findings = check_drivers(machine.testbed, machine.scenario.rates, observations)
    findings += listener.findings(commanded=machine.commanded, braked=machine.braked)
    found = Heard(by_topic(findings, MEASURED), observations, None, complete)
    console.print(topic_table(f"drivers of {machine.testbed.name}", found.topics))
    say(console, count_line(found.topics))
    if not _anything(found):
        say(console, _where())
    return found


def _anything(found: Heard) -> bool:
    return any(each.samples for each in found.observations)


def _where() -> str:
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    reach = os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"]
    return (
        f"nothing was heard on ROS_DOMAIN_ID {domain}, ROS_AUTOMATIC_DISCOVERY_RANGE {reach}: are"
        " the drivers on, on this domain, and on this computer unless the range is SUBNET?"
    )


def _testbed(path: Path) -> Testbed:
    testbed = load_testbed(path).testbed
    try:
        plant_parameters(testbed)
    except InputError as err:
        raise InputError(f"{path}: {err}") from None
    return testbed


def _keys() -> TerminalKeys:
    keys = TerminalKeys()
    if not keys.usable:
        raise InputError("--pull: standard input is no terminal, allowed: one, for its Enter key")
    return keys
