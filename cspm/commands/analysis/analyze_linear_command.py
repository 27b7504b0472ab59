"""The command `cspm analyze linear`."""

from __future__ import annotations

from collections.abc import Sequence
from math import tau
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.analysis.linear import linear_of
from cspm.analysis.machine import AnalyzedMachine
from cspm.commands.analysis.claim_table import claim_table
from cspm.commands.progress_shown import shown
from cspm_control.analysis.claim import Claim
from cspm_control.analysis.gain import condition
from cspm_control.analysis.linear import (
    LOW,
    LinearAnalyses,
    LinearAnalysis,
    SubsystemAnalysis,
)
from cspm_control.analysis.published_linear import EXACT, FROZEN
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

HEADINGS = {FROZEN: "ours, directions held", EXACT: "ours, exact"}


def analyze_linear_command(
    machine: AnalyzedMachine, folder: Path | None, json: Path | None
) -> None:
    """Analyse the linearised machine, print the results, and write the requested files.

    Raises:
        CspmError: the folder exists, or the bar has no equilibrium at this pose.
    """
    refuse_existing(folder)
    console = make_console()
    with shown(console, "linearising"):
        found = linear_of(machine)
    _show(console, machine, found.result, found.claims)
    if folder is not None:
        picture, model = found.write(folder)
        say(console, f"written {picture}, {model}")
    if json is not None:
        write_json(json, found.data())


def _show(
    console: Console, machine: AnalyzedMachine, found: LinearAnalyses, claims: Sequence[Claim]
) -> None:
    pose = ", ".join(f"{value:.4g}" for value in found.point.bar_pose)
    say(console, f"{machine.testbed.name} at rest at [{pose}] (m, rad); rank of Jᵀ {found.rank}")
    tensions = zip(machine.testbed.cable_names, found.point.tensions, strict=True)
    say(console, f"tensions [N]: {', '.join(f'{name} {value:.3f}' for name, value in tensions)}")
    for title, analysis in (
        ("cable directions held, as in the thesis", found.frozen),
        ("exact: cables turn", found.exact),
    ):
        console.print(_mode_table(title, analysis))
        if analysis.drifting:
            say(console, f"{analysis.drifting} poles at zero: nothing pulls these motions back")
        for name, part in (("motion", analysis.motion), ("tension", analysis.tension)):
            gains = ", ".join(f"{gain:.4g}" for gain in part.low.gains)
            say(
                console,
                f"{name} sub-system at {LOW:g} rad/s: σ {gains};"
                f" condition {condition(part.low.gains):.4g}",
            )
            say(console, f"  most: {_direction(part, 0)}; least: {_direction(part, -1)}")
    if claims:
        console.print(claim_table("the thesis's chapter 6", claims, HEADINGS))


def _mode_table(title: str, analysis: LinearAnalysis) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD)
    for heading in ("rad/s", "Hz", "damping ratio"):
        table.add_column(heading, justify="right")
    table.add_column("what moves")
    for mode in analysis.modes:
        table.add_row(
            f"{mode.frequency:.4g}",
            f"{mode.frequency / tau:.3g}",
            f"{mode.damping:.2g}" if mode.pole.imag > 0.0 else "1, decays",
            mode.words,
        )
    return table


def _direction(part: SubsystemAnalysis, i: int) -> str:
    """Return the dominant inputs and outputs of a direction, in words."""
    system, low = part.system, part.low

    def largest(names: tuple[str, ...], column: Any) -> str:  # noqa: ANN401 - an array
        order = abs(column).argsort()[::-1][:2]
        kept = [k for k in order if abs(column[k]) >= 0.01]
        return " and ".join(f"{abs(column[k]):.3f} {names[k]}" for k in kept)

    return (
        f"{largest(system.inputs, low.inputs[:, i])} → {largest(system.outputs, low.outputs[:, i])}"
    )
