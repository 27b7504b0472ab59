"""What `cspm check-drivers` finds of a machine at rest, asked before a run on hardware begins."""

from __future__ import annotations

from collections.abc import Collection

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Finding, Observation

# Each topic is heard for so long: 20 messages of the slowest usual motion capture, at 20 Hz [ns].
LISTEN_NS = 1_000_000_000
# Checks that need no motion; rates and delays change with what else the computer does.
STATIC = ("units", "quaternion", "axes", "balance", "holding")
# One odd message says nothing of a driver, all of them do.
_OF_ALL, _ALL = ("frame", "names", "parts"), "all messages"


class DriverStatics:
    """Hears drivers for a second, then judges them once.

    Attributes:
        passed: whether they were judged, and found without error.
    """

    def __init__(self, testbed: Testbed, rates: Rates, needed: Collection[str]) -> None:
        """Take the machine, the rates expected, and the measured topics to wait for."""
        self._testbed, self._rates = testbed, rates
        self._samples: dict[str, list[tuple[int, bytes]]] = {name: [] for name in needed}
        self.passed = False

    def hear(self, topic: str, received_ns: int, payload: bytes) -> None:
        """Take a message of any topic, received at a wall time [ns]."""
        if not self.passed and topic in self._samples:
            self._samples[topic].append((received_ns, payload))

    def restart(self) -> None:
        """Forget what came: a driver is missing, or one too many is there."""
        for samples in self._samples.values():
            samples.clear()

    def waits(self) -> bool:
        """Return whether more has to be heard, else judge the drivers, once.

        Raises:
            InputError: what they send cannot be true of the machine.
        """
        if self.passed:
            return False
        if any(not each or each[-1][0] - each[0][0] < LISTEN_NS for each in self._samples.values()):
            return True
        types = {name: self._testbed.topics[name].ros_type for name in self._samples}
        heard = [
            Observation(name, types[name], 1, tuple(samples))
            for name, samples in self._samples.items()
        ]
        refuse_static_faults(check_drivers(self._testbed, self._rates, heard))
        self.passed = True
        self.restart()
        return False


def refuse_static_faults(findings: Collection[Finding]) -> None:
    """Refuse drivers whose statics are wrong.

    Raises:
        InputError: in one line, the first of them and how many more there are.
    """
    found = [each for each in findings if each.ok is False and _counts(each)]
    if not found:
        return
    first, more = found[0], f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    raise InputError(
        f"drivers: {first.topic}: {first.text}{more}; allowed: numbers that fit the machine at"
        " rest; `cspm check-drivers` lists all"
    )


def _counts(finding: Finding) -> bool:
    of_all = finding.check in _OF_ALL and finding.text.startswith(_ALL)
    return of_all or finding.check in STATIC
