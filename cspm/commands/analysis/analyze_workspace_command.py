"""The command `cspm analyze workspace`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from cspm.analysis.machine import AnalyzedMachine
from cspm.analysis.workspace import Workspace, grids_of, workspace_of
from cspm.commands.analysis.claim_table import claim_table
from cspm.commands.progress_shown import shown
from cspm_control.analysis.claim import Claim
from cspm_control.analysis.published_workspace import OURS
from cspm_control.analysis.workspace import ALGORITHMS
from cspm_control.analysis.workspace_limits import LIMITED
from cspm_control.analysis.workspace_result import (
    ACCELERATED,
    FEASIBLE,
    WorkspaceResult,
)
from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

WAYS = {
    "pseudo_inverse": "pseudo-inverse, t ≥ 0",
    "general": "any tensions, t ≥ 0",
    FEASIBLE: "any, t ≥ t_min",
    ACCELERATED: "any, t ≥ t_min, accelerating",
}
UNITS = {"surge": "m", "sway": "m", "pitch": "rad", "yaw": "rad"}


def analyze_workspace_command(
    machine: AnalyzedMachine,
    acceleration: tuple[float, ...] | None,
    coarse: int,
    folder: Path | None,
    json: Path | None,
) -> None:
    """Compute the workspace, print the results, and write the requested files.

    Args:
        machine: what to analyse, and where.
        acceleration: required in both directions [m/s², rad/s²]; None for the RMS of the scenario's
            reference.
        coarse: step of the values that are taken of each DOF of the whole grids.
        folder: a new folder for figures; None draws none.
        json: file for the printed results; None writes none.

    Raises:
        CspmError: the folder exists, or the machine has no usable workspace.
        Abort: it was interrupted; nothing is written.
    """
    refuse_existing(folder)
    console = make_console()
    with interruptible() as stopped, _counted(console, machine, coarse) as advance:
        found = workspace_of(machine, acceleration, coarse, advance, stopped)
    if found is None:
        raise typer.Abort
    _show(console, found.result, found.claims)
    say(console, _stable_line(found))
    if folder is not None:
        say(console, f"written {', '.join(map(str, found.write(folder)))}")
    if json is not None:
        write_json(json, found.data())


@contextmanager
def _counted(
    console: Console, machine: AnalyzedMachine, coarse: int
) -> Iterator[Callable[[str, int], None]]:
    """Yield what takes an algorithm's name, and how many further poses it is through with."""
    grids = grids_of(machine)
    total = sum(grids[name].every(coarse).size for name in ALGORITHMS)
    done = 0
    with shown(console, "workspace") as progress:

        def advance(name: str, count: int) -> None:
            nonlocal done
            done += count
            progress(done / total, f"{WAYS[name]}, {total:,} poses in all")

        yield advance


def _show(console: Console, found: WorkspaceResult, claims: Sequence[Claim]) -> None:
    pose = ", ".join(f"{value:g}" for value in found.pose)
    console.print(_limit_table(f"how far the bar goes from [{pose}] in one DOF alone", found))
    required = ", ".join(f"{value:.3g}" for value in found.acceleration)
    say(
        console,
        f"accelerating: up to [{required}] m/s², rad/s² either way, all at once; at this pose the"
        f" cables give {found.factor:.3g} times that",
    )
    for name, whole in found.whole.items():
        share = whole.held / whole.poses
        reach = ", ".join(
            f"{dof} {value:g}" + (" (the grid's end)" if value >= whole.ends[dof] else "")
            for dof, value in whole.largest.items()
            if dof in whole.ends
        )
        say(
            console,
            f"{WAYS[name]}: {whole.held:,} of {whole.poses:,} poses of the whole grid,"
            f" {share:.1%}; farthest anywhere: {reach or 'nowhere'}",
        )
    for kind, value in found.largest_condition.items():
        say(console, f"largest κ over the general workspace, {kind}: {value:.5g}")
    if claims:
        console.print(claim_table("the thesis's tables 6-1 and 6-2", claims, {OURS: "ours"}))


def _stable_line(found: Workspace) -> str:
    """Return how far the bar goes until gains that stay what they are are not stable."""
    ends = found.result.whole["general"].ends
    reach = [
        f"{dof} {_limit(value, UNITS[dof], ends.get(dof))}"
        for dof, value in found.stable.items()
        if dof in ends
    ]
    if all(value is None for value in found.stable.values()):
        return "fixed gains: no loops that can be followed, or none that are stable at this pose"
    return f"fixed gains are stable, one DOF alone: {', '.join(reach)}"


def _limit_table(title: str, found: WorkspaceResult) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD)
    table.add_column("")
    for heading in WAYS.values():
        table.add_column(heading, justify="right")
    for dof in LIMITED:
        values = [found.limits[way][dof] for way in WAYS]
        end = found.whole["general"].ends.get(dof)
        cells = [_limit(value, UNITS[dof], end) for value in values]
        table.add_row(dof, *cells)
    return table


def _limit(value: float | None, unit: str, end: float | None) -> str:
    """Return a limit in words: at the end of the grid it is the grid's, not the machine's."""
    if end is None:
        return "–"
    if value is None:
        return "nowhere"
    return f"{'≥ ' if value >= end else ''}{value:g} {unit}"
