"""What `cspm check-drivers` finds of a machine at rest, asked before a run on hardware begins."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Finding, Observation, hear

# Each topic is heard for so long: 20 messages of the slowest usual motion capture, at 20 Hz [ns].
LISTEN_NS = 1_000_000_000
# A rate that is so far from the scenario's is another rate, and no busy computer's [share].
WRONG_RATE, _RATE_MARGIN = "wrong_rate", 0.4
# Checks that need no motion; delays change with what else the computer does.
STATIC = ("units", "quaternion", "axes", "balance", "holding", "finite", "clock", WRONG_RATE)
# One odd message says nothing of a driver, all of them do.
_OF_ALL, _ALL = ("frame", "names", "parts", "stamps"), "all "


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
        found = check_drivers(self._testbed, self._rates, heard)
        refuse_static_faults([*found, *map(self._rate, heard)])
        self.passed = True
        self.restart()
        return False

    def _rate(self, observation: Observation) -> Finding:
        """Judge the rate by stamps, which no busy computer changes."""
        name = observation.topic_name
        stamps = hear(self._testbed.topics[name], observation)[0].stamp_ns
        expected = float(getattr(self._rates, RATE_OF_SENSOR[name]))
        found = 1e9 / max(1.0, float(np.median(np.diff(stamps)))) if len(stamps) > 1 else expected
        ok = abs(found / expected - 1.0) <= _RATE_MARGIN
        text = f"{found:.4g} Hz, expected {expected:g} Hz (rates.{RATE_OF_SENSOR[name]})"
        return Finding(name, WRONG_RATE, ok, text)


def refuse_static_faults(findings: Collection[Finding]) -> None:
    """Refuse drivers whose statics are wrong.

    Raises:
        InputError: in one line, the first of them and how many more there are.
    """
    counting = [each for each in findings if _counts(each)]
    refuse_faults(counting, "numbers that fit the machine at rest; `cspm check-drivers` lists all")


def refuse_faults(findings: Collection[Finding], allowed: str) -> None:
    """Refuse drivers of which anything was found to be wrong.

    Raises:
        InputError: in one line, the first of it, how much more there is, and what is allowed.
    """
    found = [each for each in findings if each.ok is False]
    if not found:
        return
    first, more = found[0], f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    raise InputError(f"drivers: {first.topic}: {first.text}{more}; allowed: {allowed}")


def _counts(finding: Finding) -> bool:
    of_all = finding.check in _OF_ALL and finding.text.startswith(_ALL)
    return of_all or finding.check in STATIC
