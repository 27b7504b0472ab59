"""How late torque commands come in real time at the thesis's rates, and the computer itself."""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from bench.performance.graph_speed import DOMAIN_ID
from bench.performance.host import describe_machine
from bench.performance.thesis_machine import shipped
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.stepping.delay_histogram import UP_TO_MS, DelayHistogram
from cspm_ros.runtime.process_run import run_processes
from cspm_ros.runtime.realtime_run import run_realtime
from cspm_run.run_result import RunResult

PERIOD_NS = 1_000_000
SLOW = ("motion_capture", "motion_controller", "tension_distribution")
ALONE_S = 20.0


def wakes(seconds: float) -> DelayHistogram:
    """Return how late a process that does nothing else wakes at 1 kHz, over so long [s]."""
    found = DelayHistogram()
    due = time.monotonic_ns()
    for _ in range(round(seconds * 1e9 / PERIOD_NS)):
        # What was missed is not made up for.
        due = max(due, time.monotonic_ns() - PERIOD_NS) + PERIOD_NS
        time.sleep(max(0, due - time.monotonic_ns()) * 1e-9)
        found.add(time.monotonic_ns() - due)
    return found


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.late_commands", description=__doc__
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="of each run")
    parser.add_argument("--one-process", action="store_true", help="all nodes in one process")
    parser.add_argument("--figure", type=Path, help="a picture of the histograms")
    arguments = parser.parse_args()
    machine, alone = describe_machine(), wakes(ALONE_S)
    runner = run_realtime if arguments.one_process else partial(run_processes, mode="realtime")
    with ScratchFolder("bench") as place:
        rates = [f"rates.{name}=100" for name in SLOW]
        bundle = shipped("calm", f"duration={60.0 * arguments.minutes}", *rates)
        result = runner(bundle, place / "run", domain_id=DOMAIN_ID)
    console = Console(width=100)
    for key, value in machine.items():
        console.print(f"{key}: {value}")
    _print(console, result, alone)
    if arguments.figure is not None and result.delays is not None:
        _draw(arguments.figure, alone, result.delays)


def _print(console: Console, result: RunResult, alone: DelayHistogram) -> None:
    delays = result.delays or DelayHistogram()
    table = Table("later than, ms", "torque commands", "a process alone", box=SIMPLE_HEAD)
    for bound in UP_TO_MS:
        shares = (each.share_above(bound) for each in (delays, alone))
        table.add_row(f"{bound:g}", *(f"{share:.3%}" for share in shares))
    console.print(table)
    plant = result.timing["plant"]
    console.print(
        f"{delays.total} torque commands in {result.simulated:g} s; without one in time:"
        f" {plant['deadlines_missed']:g} steps; made late: {plant['late_steps']:g};"
        f" messages lost: {result.timing['recorder']['lost']:g}"
    )
    console.print(result.failure or "no safe state")


def _draw(path: Path, alone: DelayHistogram, delays: DelayHistogram) -> None:
    names = [f"≤ {bound:g}" for bound in UP_TO_MS] + [f"> {UP_TO_MS[-1]:g}"]
    places = np.arange(len(names))
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    parts = {"torque commands": delays, "a process alone wakes": alone}
    for i, (label, found) in enumerate(parts.items()):
        shares = 100.0 * np.array(found.counts) / max(1, found.total)
        axes.bar(places + 0.4 * (i - 0.5), shares, 0.4, label=label)
    axes.set_yscale("log")
    axes.set_xticks(places, names)
    axes.set_xlabel("delay, ms")
    axes.set_ylabel("share, %")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
