"""What `cspm identify damping` does."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out
from cspm.commands.identify_rig import RigRequest, interval_text, provenance
from cspm_ident.fitted_testbed import FittedNumber
from cspm_ident.rig.damping import CUTOFF, DAMPING, DampingResult, LinearDamping, identify_damping
from cspm_run.console import say


def identify_damping_command(asked: RigRequest, json: Path | None) -> None:
    """Identify, print, and write what was asked for.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or options.
    """
    result = identify_damping(asked.specimens(), asked.verify, asked.cutoff or CUTOFF)
    hand_out(result, print_damping, partial(_write, asked), asked.out, json)


def print_damping(console: Console, result: DampingResult) -> None:
    """Print the damping of each specimen and the law, and how well it predicts the others."""
    console.print(_specimen_table(result))
    law = result.law
    if law is None:
        say(console, "cables of one length: the slope cannot be told, no law")
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


def _write(asked: RigRequest, folder: Path, result: DampingResult) -> dict[str, str]:
    from cspm.plots.damping_figure import draw_damping

    folder.mkdir(parents=True)
    picture = folder / "damping.png"
    draw_damping(picture, result)
    written = {"damping": str(picture)}
    if result.law is not None:
        specimens = [one.specimen for one in result.specimens]
        numbers = fitted_numbers(result, result.law)
        written["testbed"] = str(asked.write_fitted(folder, specimens, "damping", numbers))
    return written


def fitted_numbers(
    result: DampingResult, law: LinearDamping
) -> dict[str, FittedNumber | float | str]:
    """Return the block `damping` of a test-bed file; what was fitted needs no factor."""
    recordings, windows = provenance([one.specimen for one in result.specimens if one.fitted])
    return {
        "law": "linear_in_length",
        "constant": FittedNumber(law.constant, law.constant_interval, recordings, windows),
        "slope": FittedNumber(law.slope, law.slope_interval, recordings, windows),
        "factor": 1.0,
    }
