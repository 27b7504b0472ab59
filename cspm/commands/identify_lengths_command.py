"""The command `cspm identify lengths`."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.commands.progress_shown import shown
from cspm.identification.lengths import identify_lengths
from cspm_ident.lengths.identify_lengths import LATE, SAG, SCALE, CableLength, LengthsResult
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say


def identify_lengths_command(
    recordings: tuple[Path, ...],
    held_out: tuple[Path, ...],
    testbed: Path | None,
    out: Path | None,
    json: Path | None,
) -> bool:
    """Hold encoders against poses, print the results, and write the requested files.

    Returns whether all parameters are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    console = make_console()
    with shown(console, "lengths"):
        found = identify_lengths(
            recordings,
            held_out=held_out,
            testbed=named_testbed(testbed),
        )
    return hand_out(found, print_lengths, out, json)


def print_lengths(console: Console, result: LengthsResult) -> None:
    """Print scale, zero and lateness of each cable, and what is off."""
    table = Table(title="l = zero - scale·(r/n)·q; 95 % intervals", box=box.SIMPLE)
    for column in ("cable", "scale", "may be stretch", "zero m", "pose late ms", "sag 1/m²"):
        table.add_column(column)
    for cable in result.cables:
        estimate = cable.estimate
        late = estimate.value(LATE), estimate.interval(LATE)
        sag = "none seen"
        if SAG in estimate.names:
            sag = interval_text(estimate.value(SAG), estimate.interval(SAG), 3)
        table.add_row(
            cable.name,
            interval_text(estimate.value(SCALE), estimate.interval(SCALE), 5),
            f"{100.0 * cable.elastic:.2g} %",
            interval_text(cable.zero[0], cable.zero[1], 5),
            interval_text(1e3 * late[0], (1e3 * late[1][0], 1e3 * late[1][1]), 3),
            sag,
        )
    console.print(table)
    for cable in result.cables:
        if cable.is_off:
            say(console, f"• {_off(cable)}")
    if result.standing:
        say(console, f"no motion, so nothing identified: {', '.join(result.standing)}")
    console.print(_error_table(result))


def _off(cable: CableLength) -> str:
    scale = cable.estimate.value(SCALE)
    words = "more" if scale > 1.0 else "less"
    return (
        f"the cable of {cable.name} moves {abs(100.0 * (scale - 1.0)):.3g} % {words} than its"
        " encoder says: another drum radius, gear ratio or number of counts per turn"
    )


def _error_table(result: LengthsResult) -> Table:
    table = Table(title="RMS error of the length about its mean, mm", box=box.SIMPLE)
    for column in ("cable", "recording", "described", "fitted"):
        table.add_column(column, justify="left" if column in ("cable", "recording") else "right")
    for cable in result.cables:
        for path, held_out, before, after in cable.errors:
            name = Path(path).name + (", held out" if held_out else "")
            table.add_row(cable.name, name, f"{before:.3g}", f"{after:.3g}")
    return table
