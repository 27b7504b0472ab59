"""The command `cspm identify geometry`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.identify_outcome import hand_out
from cspm.commands.progress_shown import shown
from cspm.identification.geometry import identify_geometry
from cspm_ident.geometry.combinations import Combination
from cspm_ident.geometry.identify_geometry import (
    AXES,
    RADIUS,
    STIFFNESS,
    GeometryResult,
    Number,
)
from cspm_ident.geometry.unknowns import ENDS
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say

# What is shown of each unit.
_SHOWN = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1e2, "%"), "s": (1e3, "ms")}


def identify_geometry_command(
    recordings: tuple[Path, ...],
    held_out: tuple[Path, ...],
    testbed: Path | None,
    out: Path | None,
    json: Path | None,
) -> bool:
    """Fit ends of cables and drum radii, print the results, and write the requested files.

    Returns whether all numbers are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    console = make_console()
    with shown(console, "geometry"):
        found = identify_geometry(recordings, held_out=held_out, testbed=named_testbed(testbed))
    return hand_out(found, print_geometry, out, json)


def print_geometry(console: Console, result: GeometryResult) -> None:
    """Print what each number is off by, what is beyond its accuracy, and what is not determined."""
    for end in ENDS:
        title = f"{end}s: off by, mm, ± half of 95 %; in brackets: not determined by the motion"
        names = [f"{end} {axis}" for axis in AXES]
        console.print(_table(title, ("cable", *AXES), result, names))
    shares = [RADIUS, STIFFNESS][: len(result.cables[0].numbers) - 6]
    title = "off by, % of the file's number; in brackets: not determined by the motion"
    console.print(_table(title, ("cable", *shares), result, shares))
    say(console, f"poses are stamped late by {_text(result.lateness)} ms")
    for cable in result.cables:
        for each in cable.numbers:
            if each.beyond:
                size, unit = _SHOWN[each.unit]
                accuracy = f"{size * each.accuracy:.3g} {unit}"
                say(
                    console,
                    f"• {cable.name}: {each.name} {_text(each)} {unit} off, beyond its accuracy"
                    f" of {accuracy}{_about(each)}",
                )
    for group, factor in result.factors.items():
        if factor > 1.5:
            say(console, f"{group}: errors are {factor:.2g} times those usual in laboratories")
    still = [cable.name for cable in result.cables if not cable.moves]
    if still:
        say(console, f"no motion, so no radius identified: {', '.join(still)}")
    if result.undetermined:
        console.print(_undetermined_table(result.undetermined))
    console.print(_error_table(result))


def _about(number: Number) -> str:
    if number.name != RADIUS:
        return ""
    return ": another drum radius, gear ratio or number of counts per turn"


def _text(number: Number) -> str:
    size, _ = _SHOWN[number.unit]
    half = 0.5 * (number.ci95[1] - number.ci95[0])
    text = f"{size * number.off:.3g} ± {size * half:.2g}"
    return text if number.determined else f"({text})"


def _table(title: str, heads: Sequence[str], result: GeometryResult, names: Sequence[str]) -> Table:
    table = Table(title=title, box=box.SIMPLE)
    for head in heads:
        table.add_column(head, justify="left" if head == "cable" else "right")
    for cable in result.cables:
        table.add_row(cable.name, *(_text(cable.number(name)) for name in names))
    return table


def _undetermined_table(combinations: Sequence[Combination]) -> Table:
    title = (
        "not determined by this motion: standard deviation before, after, and with a further motion"
    )
    table = Table(title=title, box=box.SIMPLE)
    for head in ("combination", "cables", "before", "after", "motion that determines it", "then"):
        table.add_column(head)
    for each in combinations:
        size, unit = _SHOWN[each.unit]
        then = f"{size * each.sd_with:.2g} {unit}" if each.motion else ""
        table.add_row(
            each.name,
            ", ".join(each.cables) or "all",
            f"{size * each.accuracy:.2g} {unit}",
            f"{size * each.sd:.2g} {unit}",
            each.motion or "none: measure one of its numbers",
            then,
        )
    return table


def _error_table(result: GeometryResult) -> Table:
    table = Table(title="RMS error of the length about its mean, mm", box=box.SIMPLE)
    for column in ("cable", "recording", "described", "fitted"):
        table.add_column(column, justify="left" if column in ("cable", "recording") else "right")
    for cable in result.cables:
        for path, held_out, before, after in cable.errors:
            name = Path(path).name + (", held out" if held_out else "")
            table.add_row(cable.name, name, f"{before:.3g}", f"{after:.3g}")
    return table
