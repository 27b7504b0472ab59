"""The command `cspm analyze reference`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from cspm.analysis.reference import ReferenceAnalysis, reference_of
from cspm.commands.progress_shown import shown
from cspm.commands.run_command import bundle_from
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.recording.run_record import SIM
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def analyze_reference_command(
    path: Path,
    overrides: Sequence[str],
    machine: Path | None,
    folder: Path | None,
    json: Path | None,
) -> None:
    """Compute what a scenario's reference needs, print it, and write the requested files.

    Raises:
        CspmError: the folder exists, or no bar follows a reference.
    """
    refuse_existing(folder)
    console = make_console()
    with shown(console, "reference"):
        found = reference_of(bundle_from(path, overrides, machine, SIM))
    console.print(_table(found))
    for line in _lines(found):
        say(console, line)
    if folder is not None:
        say(console, f"written {found.write(folder)}")
    if json is not None:
        write_json(json, found.data())


def _lines(found: ReferenceAnalysis) -> list[str]:
    lines = ["the wrench is feasible within the tension limits all the time"]
    if found.worst is not None:
        time, dof = found.worst
        share = f"{found.unmet_share:.1%}"
        lines = [f"wrench infeasible {share} of the time, most in {dof} at {time:.4g} s"]
    loads = [f"{name} {share:.0%}" for name, share in found.overloaded.items()]
    lines.append(
        f"motor torque over its limit: {', '.join(loads)}"
        if loads
        else "motor torque within limits"
    )
    return lines


def _table(found: ReferenceAnalysis) -> Table:
    title = f"what the reference of {found.name} needs of {found.testbed.name}"
    table = Table(title=title, box=box.SIMPLE_HEAD)
    table.add_column("cable")
    for heading in ("tension", "allowed", "motor speed", "motor torque", "limit"):
        table.add_column(heading, justify="right")
    for cable, limit in zip(found.data()["cables"], found.limits, strict=True):
        low, high = cable["tension"]
        table.add_row(
            cable["name"],
            f"{low:.4g} to {high:.4g} N",
            f"{limit[0]:.4g} to {limit[1]:.4g} N",
            f"{cable['speed']:.3g} rad/s",
            f"{cable['torque']:.3g} N·m",
            f"{cable['torque_limit']:.3g} N·m",
        )
    return table
