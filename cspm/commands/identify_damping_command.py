"""The command `cspm identify damping`."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.commands.progress_shown import shown
from cspm.identification.cables import identified_damping
from cspm.rig import RigRequest
from cspm_ident.rig.damping import DAMPING, DampingResult
from cspm_run.output.console import make_console, say


def identify_damping_command(request: RigRequest, json: Path | None) -> bool:
    """Identify the cable damping, print the results, and write the requested files.

    Returns whether all parameters are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    with shown(make_console(), "fitting"):
        found = identified_damping(request)
    return hand_out(found, print_damping, request.out, json)


def print_damping(console: Console, result: DampingResult) -> None:
    """Print each specimen's damping, the law, and its fit to specimens that were not fitted."""
    console.print(_specimen_table(result))
    law = result.law
    if law is None:
        say(console, "cables of one length: the slope cannot be identified, no law")
        return
    constant = interval_text(law.constant, law.constant_interval, 5)
    slope = interval_text(law.slope, law.slope_interval, 5)
    say(console, f"damping = {constant} N·s/m - {slope} N·s/m² · l")
    say(console, f"scatter about the line: {law.scatter:.2g} of what the intervals say")
    for label, value in result.verified.items():
        say(console, f"{label}, not fitted: VAF {value:.3f} % of the tension by both laws")


def _specimen_table(result: DampingResult) -> Table:
    table = Table(title="t = t_el(ε) + b·dε/dt; 95 % intervals", box=box.SIMPLE)
    table.add_column("cable")
    table.add_column("l m", justify="right")
    table.add_column("b N·s/m")
    for column in ("line N·s/m", "offset N", "least tension N", "VAF %"):
        table.add_column(column, justify="right")
    for one in result.specimens:
        estimate = one.estimate
        table.add_row(
            escape(one.specimen.label) + ("" if one.fitted else ", not fitted"),
            f"{one.mean_length:.4f}",
            interval_text(estimate.value(DAMPING), estimate.interval(DAMPING), 5),
            f"{result.law.at(one.mean_length):.4f}" if result.law else "",
            f"{one.offset:.2f}",
            f"{one.lowest:.2f}",
            f"{one.vaf:.4f}",
        )
    return table
