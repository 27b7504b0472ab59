"""The command `cspm analyze design`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from cspm.analysis.design import design_of
from cspm.analysis.machine import AnalyzedMachine
from cspm.commands.progress_shown import shown
from cspm_control.analysis.loop_view import LoopView
from cspm_control.analysis.loops import (
    CASCADE,
    DESIGNED,
    LATE,
    SAMPLED,
    LoopAnalysis,
    pid_law,
)
from cspm_control.analysis.sampled_loops import LoopTiming
from cspm_control.design.gains import (
    GAIN_MARGIN,
    LOW_FREQUENCY_GAIN,
    MOTION_BANDWIDTH,
    PHASE_MARGIN,
)
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.scenario import ClosedLoop
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

WAYS = {
    DESIGNED: "designed",
    SAMPLED: "sampled",
    CASCADE: "cascade",
    LATE: "computing",
}
MEANINGS = {
    DESIGNED: "continuous, this loop alone, cable directions held: the thesis's way",
    SAMPLED: "the same, sampled, with the sensors' delays",
    CASCADE: "sampled, every other loop closed, exact model",
    LATE: "the same, torques late by the time of computing",
}


def analyze_design_command(
    machine: AnalyzedMachine,
    computing: float | None,
    folder: Path | None,
    json: Path | None,
) -> None:
    """Analyse all loops of a scenario, print the results, and write the requested files.

    Args:
        machine: with its scenario.
        computing: delay from a measurement to its torque [s]; None for one period of the force
            controllers.
        folder: a new folder for figures; None draws none.
        json: file for the printed results; None writes none.

    Raises:
        CspmError: the folder exists, or the scenario has no loops that can be analysed.
    """
    refuse_existing(folder)
    console = make_console()
    with shown(console, "loops"):
        found = design_of(machine, computing)
    _show(console, machine, found.control, found.result, found.timing, found.groups)
    torque, tension = (1e3 * age for age in found.largest_ages.values())
    say(
        console,
        f"in real time a torque may answer a state {torque:.3g} ms old, with drive: tension a"
        f" tension one {tension:.3g} ms old; later ones trip",
    )
    if folder is not None:
        say(console, f"written {', '.join(map(str, found.write(folder)))}")
    if json is not None:
        write_json(json, found.data())


def _show(
    console: Console,
    machine: AnalyzedMachine,
    control: ClosedLoop,
    found: LoopAnalysis,
    timing: LoopTiming,
    groups: dict[str, str],
) -> None:
    milliseconds = 1e3 * timing.period
    say(
        console,
        f"{machine.scenario.name}: motion controller every {timing.motion * milliseconds:g} ms,"
        f" force controllers every {timing.force * milliseconds:g} ms; pose"
        f" {timing.pose_delay * milliseconds:g} ms late, tensions"
        f" {timing.tension_delay * milliseconds:g} ms, computing"
        f" {timing.torque_delay * milliseconds:g} ms",
    )
    for way, meaning in MEANINGS.items():
        say(console, f"  {WAYS[way]}: {meaning}")
    console.print(_gain_table(control, groups))
    console.print(_motion_table(found))
    console.print(_force_table(found, list(groups.values())))
    for way, (growth, frequency) in found.growth.items():
        what = "grows" if growth > 0.0 else "decays"
        say(
            console,
            f"{WAYS[way]}: the slowest motion {what} as exp({growth:.3g}·t), t in s, at"
            f" {frequency:.4g} rad/s",
        )


def _gain_table(control: ClosedLoop, groups: dict[str, str]) -> Table:
    table = Table(title="gains", box=box.SIMPLE_HEAD)
    for heading in ("loop", "Kp", "Ki", "Kd", "integral rad/s"):
        table.add_column(heading, justify="left" if heading == "loop" else "right")
    for dof, pid in (pid_law(control).gains or {}).items():
        table.add_row(dof, f"{pid.kp:.4g}", f"{pid.ki:.4g}", f"{pid.kd:.4g}", "")
    for name, first in groups.items():
        pi = (control.force.gains or {})[first]
        label = name if name == first else f"{name} cables"
        table.add_row(label, f"{pi.kp:.4g}", "", "", f"{pi.integral_frequency:.4g}")
    return table


def _motion_table(found: LoopAnalysis) -> Table:
    table = _margin_table("motion loops")
    table.add_column("as required")
    for dof in found.motion[DESIGNED]:
        for way, loops in found.motion.items():
            verdict = "[green]yes[/]" if meets_requirements(loops[dof]) else "[red]no[/]"
            table.add_row(dof if way == DESIGNED else "", WAYS[way], *_cells(loops[dof]), verdict)
    return table


def _force_table(found: LoopAnalysis, cables: list[str]) -> Table:
    table = _margin_table("force loops, one cable of those with the same gains, other torques held")
    for name in cables:
        for way, loops in found.force.items():
            # The force loops alone form no cascade, so the label does not name one.
            label = "sampled, computing" if way == LATE else WAYS[way]
            table.add_row(name if way == DESIGNED else "", label, *_cells(loops[name]))
    return table


def _margin_table(title: str) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD)
    table.add_column("loop")
    table.add_column("way")
    for heading in (
        "crossover rad/s",
        "bandwidth rad/s",
        "phase °",
        "gain dB",
        "low gain dB",
        "settled s",
    ):
        table.add_column(heading, justify="right")
    return table


def _cells(view: LoopView) -> list[str]:
    found = view.margins
    values = (
        found.crossover,
        found.bandwidth,
        np.degrees(found.phase_margin),
        found.gain_margin,
        found.low_frequency_gain,
        view.settling_time,
    )
    return [f"{value:.4g}" if np.isfinite(value) else "–" for value in values]


def meets_requirements(view: LoopView) -> bool:
    """Return whether a motion loop meets all requirements of the thesis's section 7-1."""
    found = view.margins
    return bool(
        found.phase_margin >= PHASE_MARGIN
        and found.gain_margin >= GAIN_MARGIN
        and found.low_frequency_gain >= LOW_FREQUENCY_GAIN
        and found.bandwidth >= MOTION_BANDWIDTH
    )
