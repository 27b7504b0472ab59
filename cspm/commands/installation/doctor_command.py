"""The command `cspm doctor`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path

from rich import box
from rich.markup import escape
from rich.table import Table

from cspm.doctor.computer import computer
from cspm.doctor.part import Part
from cspm.doctor.software import software
from cspm_msgs_py.installed.dependencies import Dependency, dependencies
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

_BASE = "base"


def doctor_command(json: Path | None, *, listed: bool) -> None:
    """Print what is there, what is missing, and a remedy for each.

    Args:
        json: file for the same as data; None writes none.
        listed: whether to list every dependency with its licence and size.
    """
    console = make_console()
    parts = list(chain(software(), computer()))
    for each in parts:
        say(console, f"{'there  ' if each.there else 'missing'}  {each.name}: {each.found}")
        if not each.there:
            serves = f"  (for {each.serves})" if each.serves else ""
            say(console, f"         remedy: {each.remedy}{serves}")
    data = {"parts": [_data(each) for each in parts]}
    if listed:
        found = dependencies()
        console.print(_table(found))
        data["dependencies"] = [each._asdict() for each in found]
    if json is not None:
        write_json(json, data)


def _data(part: Part) -> dict[str, object]:
    return {**asdict(part), "there": part.there}


def _table(found: Sequence[Dependency]) -> Table:
    """Return the dependencies of the base and of each extra, with the sum of their sizes."""
    table = Table(title="dependencies", box=box.SIMPLE, pad_edge=False)
    for name in ("for", "name", "version", "licence (SPDX)"):
        table.add_column(name, overflow="fold")
    table.add_column("MB", justify="right", no_wrap=True)
    for part in dict.fromkeys(each.extra for each in found):
        those = [each for each in found if each.extra == part]
        for each in those:
            cells = (part or _BASE, each.name, each.version or "missing", each.licence)
            table.add_row(*map(escape, cells), f"{each.size / 1e6:.1f}")
        total = sum(each.size for each in those)
        table.add_row(part or _BASE, "all of these", "", "", f"{total / 1e6:.1f}", end_section=True)
    return table
