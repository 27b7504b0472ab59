"""The command `cspm analyze sag`."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.table import Table

from cspm.analysis.machine import AnalyzedMachine
from cspm.analysis.sag import SagAnalysis, sag_of
from cspm.commands.progress_shown import shown
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def analyze_sag_command(
    machine: AnalyzedMachine, linear_density: float | None, json: Path | None
) -> None:
    """Compute how cables with weight hold the bar, print it, and write the requested file.

    Raises:
        CspmError: no density, a cable over a pulley, or nothing holds bar and cables.
    """
    console = make_console()
    with shown(console, "sag"):
        found = sag_of(machine, linear_density)
    pose = ", ".join(f"{value:g}" for value in machine.pose)
    say(console, f"{machine.testbed.name} at [{pose}] (m, rad), at rest, by elastic catenaries")
    console.print(_table(found))
    worst = max(found.cables, key=lambda each: each.sag)
    say(console, f"largest sag {1e3 * worst.sag:.3g} mm, of {worst.name}")
    if json is not None:
        write_json(json, found.data())


def _table(found: SagAnalysis) -> Table:
    table = Table(title="cables with weight", box=box.SIMPLE_HEAD)
    table.add_column("cable")
    for heading in ("kg/m", "straight", "at exit", "at bar", "sag", "longer", "stiffness"):
        table.add_column(heading, justify="right")
    for density, each in zip(found.densities, found.cables, strict=True):
        table.add_row(
            each.name,
            f"{density:.3g}",
            f"{each.straight:.4g} N",
            f"{each.tension:.4g} N",
            f"{each.end_tension:.4g} N",
            f"{1e3 * each.sag:.3g} mm",
            f"{1e3 * each.longer:.3g} mm",
            f"{100.0 * each.stiffness:.1f} %",
        )
    return table
