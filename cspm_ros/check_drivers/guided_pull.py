"""Leads a person through the pull test: what to do, when, and what it showed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from rich.console import Console

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_observation import Array, Finding, Observation, hear
from cspm_ros.check_drivers.driver_report import print_findings
from cspm_ros.check_drivers.pull_response import (
    PullVerdict,
    Window,
    analyse_pull,
    instruction,
    swapped,
)
from cspm_ros.check_drivers.time_bar import time_bar

ALL = "all"
REST_S = 1.0
KEYS = "Enter: begin, hands off for a second, then pull · s: leave this cable out · q: end"
_BEGIN, _SKIP, _END = ("\n", "\r"), "s", "q"


class Listener(Protocol):
    """What hears the drivers."""

    def wait_for(self, done: Callable[[], bool]) -> bool:
        """Wait; return whether it is done, False after a signal."""

    def listen(self, seconds: float, progress: Callable[[float], None]) -> bool:
        """Forget what came and hear what comes for some seconds; return False after a signal."""

    def observations(self) -> list[Observation]:
        """Return what was heard."""


class Keys(Protocol):
    """What reads a terminal's keys."""

    def read(self) -> list[str]:
        """Return the keys pressed since the last look."""


class Pulls(NamedTuple):
    """What the pulls showed.

    Attributes:
        verdicts: one for each cable that was pulled.
        swapped: which cables answer for each other.
        complete: whether the test was not ended early.
    """

    verdicts: list[PullVerdict]
    swapped: list[Finding]
    complete: bool

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.swapped and all(verdict.ok is not False for verdict in self.verdicts)


class GuidedPull:
    """The pull test at a machine that is listened to."""

    def __init__(
        self, testbed: Testbed, listener: Listener, keys: Keys, console: Console, seconds: float
    ) -> None:
        """Take the machine, who hears it, the person's terminal, and how long each pull lasts."""
        self._testbed, self._listener = testbed, listener
        self._keys, self._console, self._seconds = keys, console, seconds

    def run(self, cables: Sequence[str]) -> Pulls:
        """Request a pull at each of these cables, and judge it."""
        verdicts = []
        for number, cable in enumerate(cables, start=1):
            self._say(f"\n{number} of {len(cables)}: {instruction(cable, self._seconds)}")
            key = self._wait_for_key()
            if key == _SKIP:
                continue
            windows = self._windows(cable) if key in _BEGIN else None
            if windows is None:
                break
            verdicts.append(analyse_pull(self._testbed, cable, *windows))
            print_findings(self._console, verdicts[-1].findings)
        else:
            return self._end(verdicts, complete=True)
        return self._end(verdicts, complete=False)

    def _end(self, verdicts: list[PullVerdict], *, complete: bool) -> Pulls:
        found = Pulls(verdicts, swapped(verdicts), complete)
        if found.swapped:
            self._say("")
            print_findings(self._console, found.swapped)
        return found

    def _wait_for_key(self) -> str:
        """Return the key that was pressed, an empty text after a signal."""
        self._keys.read()
        self._say(KEYS)
        pressed: list[str] = []

        def chosen() -> bool:
            pressed.extend(key for key in self._keys.read() if key in (*_BEGIN, _SKIP, _END))
            return bool(pressed)

        return pressed[0] if self._listener.wait_for(chosen) else ""

    def _windows(self, cable: str) -> tuple[Window, Window] | None:
        """Return what was measured at rest and during the pull; None after a signal."""
        before = self._measure(REST_S, "hands off")
        if before is None:
            return None
        self._console.bell()
        during = self._measure(self._seconds, f"pull {cable} now")
        self._console.bell()
        return None if during is None else (before, during)

    def _measure(self, seconds: float, text: str) -> Window | None:
        self._say(text)
        with time_bar(self._console, text, seconds) as show:
            whole = self._listener.listen(seconds, show)
        return window_of(self._testbed, self._listener.observations()) if whole else None

    def _say(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)


def window_of(testbed: Testbed, observations: Iterable[Observation]) -> dict[str, Array]:
    """Return the finite rows (n, width) of each measured topic; parts that it lacks are zero."""
    window = {}
    for each in observations:
        if each.topic_name in MEASURED and each.topic_name in testbed.topics:
            heard, _ = hear(testbed.topics[each.topic_name], each)
            rows = np.where(heard.present, heard.values, 0.0)
            window[each.topic_name] = rows[np.isfinite(rows).all(axis=1)]
    return window


def pulled_cables(text: str, testbed: Testbed) -> tuple[str, ...]:
    """Return the cables that `all`, or names with commas, stand for.

    Raises:
        InputError: a name that is no cable with a far end to pull at.
    """
    possible = [cable.name for cable in testbed.cables if cable.has_cable]
    names = possible if text == ALL else text.split(",")
    for name in names:
        if name not in possible:
            allowed = ", ".join((ALL, *possible))
            raise InputError(f"--pull {name}: no such cable, allowed: {allowed}")
    return tuple(names)
