"""Checking somebody's drivers: what they are held against, listening, and the report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cspm.progress import Progress
from cspm.scenario import AnyScenario, as_scenario, overridden
from cspm.testbed import AnyTestbed, as_file, check_plant
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import LockedWinches, Rates, Scenario, parse_scenario
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Finding, Observation
from cspm_ros.check_drivers.driver_report import by_topic, findings_data, pulls_data, topics_data
from cspm_ros.check_drivers.guided_pull import Pulls
from cspm_ros.runtime.ros_install import find_ros

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


@dataclass(frozen=True, eq=False)
class DriverReport:
    """What was found about drivers.

    Attributes:
        machine: what they were held against.
        seconds: how long it was to listen [s].
        topics: findings by topic; each has `check`, `text` and `ok`, None for a warning.
        observations: what was received.
        complete: whether nothing ended it early.
        pulls: what a guided pull test showed; None without one.
    """

    machine: Machine
    seconds: float
    topics: dict[str, list[Finding]]
    observations: list[Observation]
    complete: bool
    pulls: Pulls | None = None

    @property
    def ok(self) -> bool:
        """Whether there is no error, whatever there was time to check."""
        fine = all(each.ok is not False for findings in self.topics.values() for each in findings)
        return fine and (self.pulls is None or self.pulls.ok)

    @property
    def heard(self) -> bool:
        """Whether any message was received."""
        return any(each.samples for each in self.observations)

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm check-drivers --json` writes."""
        found = {
            "testbed": self.machine.testbed.name,
            "scenario": self.machine.scenario.name,
            "seconds": self.seconds,
            "complete": self.complete,
            "ok": self.ok,
            "topics": topics_data(self.topics, self.observations),
        }
        if self.pulls is None:
            return found
        pulls = pulls_data(self.pulls.verdicts)
        return found | {"pulls": pulls, "swapped": findings_data(self.pulls.swapped)}


def machine_of(
    scenario: AnyScenario | None, testbed: AnyTestbed | None, overrides: Sequence[str] = ()
) -> Machine:
    """Return the machine of a scenario, or of a test-bed alone.

    With a test-bed alone, the rates are those of a scenario without `rates`, or its sensors' where
    lower.

    Raises:
        InputError: none or both are given, or the file cannot be used.
    """
    if scenario is not None and testbed is None:
        chosen = overridden(as_scenario(scenario), overrides)
        file = chosen.testbed_file
        check_plant(file)
        return Machine(file.testbed, chosen.description)
    if testbed is None or scenario is not None:
        raise InputError("check-drivers: allowed: a scenario or a test-bed, one of both")
    file = as_file(testbed)
    check_plant(file)
    machine, rates = file.testbed, Rates().model_dump()
    for name, sensor in machine.sensors.items():
        key = RATE_OF_SENSOR[name]
        rates[key] = min(rates[key], sensor.rate)
    content = {"name": machine.name, "testbed": file.source, "duration": 1.0, "rates": rates}
    return Machine(machine, parse_scenario(dump_yaml(content), file.source, overrides))


@contextmanager
def listener_to(
    machine: Machine, seconds: float, *, sim_time: bool = False
) -> Iterator[DriverListener]:
    """Give a node that hears the drivers of a machine, as long as the context lasts.

    Args:
        machine: whose drivers.
        seconds: how long it is to listen at a time [s].
        sim_time: whether stamps follow `/clock`.

    Raises:
        InputError: too short or too long a time, or no ROS.
    """
    if not SHORTEST_S <= seconds <= LONGEST_S:
        raise InputError(f"listening for {seconds:g} s: allowed: {SHORTEST_S:g} to {LONGEST_S:g} s")
    find_ros("check-drivers")
    # Loading ROS comes after looking for it.
    from cspm_msgs_py.ros.session import Session
    from cspm_ros.check_drivers.driver_listener import DriverListener

    with Session() as session:
        yield DriverListener(session, machine.testbed, sim_time=sim_time)


def listened(
    machine: Machine, listener: DriverListener, seconds: float, progress: Progress
) -> DriverReport:
    """Find drivers, listen to them for a time [s], and report what does not fit the machine.

    `progress` is called with the share of that time and what is being done.
    """
    progress(0.0, "looking for drivers")
    there, what = listener.find(), f"listening to {machine.testbed.name}"
    complete = not there or listener.listen(
        seconds, lambda passed: progress(passed / seconds, what)
    )
    observations = listener.observations()
    findings = check_drivers(machine.testbed, machine.scenario.rates, observations)
    findings += listener.findings(commanded=machine.commanded, braked=machine.braked)
    return DriverReport(machine, seconds, by_topic(findings, MEASURED), observations, complete)
