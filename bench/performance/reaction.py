"""How long the winches are without a safe command when a node dies or stops."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import NamedTuple

import psutil
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from bench.performance.host import describe_machine
from bench.performance.slow_machine import PERIOD_S, slow_overrides
from bench.performance.thesis_machine import SCENARIOS
from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.recover import recover
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    MOTION_CONTROLLER,
    PLANT,
    TENSION_DISTRIBUTION,
    WAVE_TRAJECTORY,
)
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_run.assembly import resolve
from cspm_run.bundle import Bundle, make_bundle

DOMAIN_ID = 84
WAIT_S = 0.2
STRIKE_AT_S, DURATION_S = 1.0, 3.0
WATCHDOG = "plant/watchdog"
# Who reacts, and how many waits one after the other lead there.
REACTS = {
    WAVE_TRAJECTORY: (FORCE_CONTROLLER, 3),
    MOTION_CONTROLLER: (FORCE_CONTROLLER, 2),
    TENSION_DISTRIBUTION: (FORCE_CONTROLLER, 1),
    PLANT: (FORCE_CONTROLLER, 1),
    FORCE_CONTROLLER: (WATCHDOG, 1),
}
SIGNALS = (signal.SIGKILL, signal.SIGSTOP)
STATES = ("hold", "brake")


class ReactionCase(NamedTuple):
    """Who is struck by what, and the machine's safe state."""

    node: str
    number: signal.Signals
    state: str


def print_reactions(console: Console, repetitions: int) -> None:
    """Strike each node `repetitions` times in each way and print the table of reaction times."""
    for name, value in describe_machine().items():
        console.print(f"{name + ':':14}{value}", highlight=False, soft_wrap=True)
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for column in ("struck", "by", "safe state", "reacts"):
        table.add_column(column, no_wrap=True)
    for column in ("waits, ms", "median, ms", "worst, ms", "runs"):
        table.add_column(column, justify="right", no_wrap=True)
    for node, (guard, waits) in REACTS.items():
        for number in SIGNALS:
            for state in STATES:
                found = [_reaction(ReactionCase(node, number, state)) for _ in range(repetitions)]
                times = [each * 1e3 for each in found if each is not None]
                shown = [f"{median(times):.0f}", f"{max(times):.0f}"] if times else ["", ""]
                runs = f"{len(times)} of {repetitions}"
                table.add_row(
                    node, number.name, state, guard, f"{waits * WAIT_S * 1e3:.0f}", *shown, runs
                )
                console.print(f"{node}, {number.name}, {state}: {', '.join(shown)} ms, {runs}")
    console.print(table)
    loads = ", ".join(f"{load:.1f}" for load in os.getloadavg())
    console.print(f"period {PERIOD_S * 1e3:g} ms; load after: {loads} (1, 5, 15 min)")


def _reaction(case: ReactionCase) -> float | None:
    """Return the time from the signal to the safe state [s]; None if that was before, or never."""
    from cspm_ros.runtime.node_parameters import REALTIME
    from cspm_ros.runtime.process_run import run_processes

    strike = _Strike(case.node, case.number)
    with ScratchFolder("bench") as place:
        folder = place / "run"
        # What the others did is in the recording.
        with suppress(CspmError):
            run_processes(_bundle(case.state), folder, strike, mode=REALTIME, domain_id=DOMAIN_ID)
        recover(folder)
        since = next(_alarms(folder, REACTS[case.node][0]), None)
    if strike.at_s is None or since is None or since < strike.at_s:
        return None
    return since - strike.at_s


def _bundle(state: str) -> Bundle:
    waits = ", ".join(f"{key}: {WAIT_S}" for key in ("stale_after", "watchdog", "lateness"))
    safety = f"safety={{state: {state}, {waits}}}"
    overrides = (*slow_overrides(), safety, f"duration={DURATION_S}")
    scenario = load_scenario(SCENARIOS / "rest.yaml", overrides)
    testbed = load_testbed(SCENARIOS / scenario.testbed)
    return make_bundle(resolve(scenario, testbed.testbed), testbed, SCENARIOS)


class _Strike:
    """Sends a node a signal once the run is under way.

    Attributes:
        at_s: when it did, on the clock of the run's stamps [s].
    """

    def __init__(self, node: str, number: signal.Signals) -> None:
        self._node, self._number = node, number
        self.at_s: float | None = None

    def __call__(self, simulated: float) -> None:
        if self.at_s is not None or simulated < STRIKE_AT_S:
            return
        for process in psutil.Process().children(recursive=True):
            # The title of a process that was forked is one text.
            words = " ".join(process.cmdline()).split()
            if "cspm_ros.runtime.node_main" in words and self._node in words:
                self.at_s = time.time()
                process.send_signal(self._number)


def _alarms(folder: Path, guard: str) -> Iterator[float]:
    """Yield when a guard entered its safe state, as it reported [s]."""
    with Recording(folder) as recording:
        payloads = recording.payloads(DIAGNOSTICS.name).payloads
    for payload in payloads:
        for status in decode_diagnostics(payload).statuses:
            if status.name == guard and status.message.startswith("safe state "):
                yield float(status.message.partition(" since ")[2].partition(" s:")[0])
