"""The command `cspm identify stiffness`."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.commands.progress_shown import shown
from cspm.identification.cables import identified_stiffness
from cspm.rig import RigRequest
from cspm_ident.rig.flanks import DOWN, UP
from cspm_ident.rig.stiffness import MEAN, StiffnessResult
from cspm_ident.rig.stiffness_fit import NAMES
from cspm_run.output.console import make_console, say

LAW = "k = min(a/l^b (e^(c t) - e^(d t)), E A/l)"


def identify_stiffness_command(request: RigRequest, json: Path | None) -> bool:
    """Identify the cable stiffness, print the results, and write the requested files.

    Returns whether all parameters are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    with shown(make_console(), "fitting"):
        found = identified_stiffness(request)
    return hand_out(found, print_stiffness, request.out, json)


def print_stiffness(console: Console, result: StiffnessResult) -> None:
    """Print the law of both branches and of each alone, the candidates and the specimens."""
    console.print(_law_table(result))
    found = result.both.estimate
    for direction in found.unexcited:
        say(console, f"not seen in these recordings: {direction.name}")
    for name in found.at_bound:
        say(console, f"{name} is at the end of its range: its interval does not hold")
    if not result.both.fits:
        say(
            console,
            "what the law leaves is more than the cycles differ by: it is not quite these cables',"
            " and its intervals come from its residuals where those are wider",
        )
    if not result.both.asymptote:
        say(console, "the asymptote E A/l is not reached: E stays what the test-bed file says")
    if "b" in found.frozen:
        say(console, "cables of one length: b stays 1, Hooke's law")
    console.print(_candidate_table(result))
    console.print(_specimen_table(result))
    console.print(_hysteresis_table(result))


def _law_table(result: StiffnessResult) -> Table:
    table = Table(title=f"{LAW}, t in N, l in m; 95 % intervals", box=box.SIMPLE)
    for column in ("", "both branches", "up alone", "down alone"):
        table.add_column(column)
    laws = (result.both, result.alone[UP], result.alone[DOWN])
    for name in NAMES[:-1]:
        cells = [
            interval_text(one.estimate.value(name), one.estimate.interval(name)) for one in laws
        ]
        unit = result.both.estimate.units[NAMES.index(name)]
        table.add_row(f"{name} [{unit}]" if unit != "1" else name, *cells, style=None)
    cells = []
    for one in laws:
        low, high = one.estimate.interval("rigidity")
        scale = 1e-6 / result.area
        value = interval_text(scale * one.law.rigidity, (scale * low, scale * high))
        cells.append(value if one.asymptote else "not reached")
    table.add_row(escape("E [N/mm²]"), *cells)
    return table


def _candidate_table(result: StiffnessResult) -> Table:
    table = Table(title="functions of the tension, by cycles not fitted to", box=box.SIMPLE)
    table.add_column("function")
    table.add_column("k(t), each up to an asymptote")
    table.add_column("parameters", justify="right")
    table.add_column("VAF %", justify="right")
    for rank in result.candidates:
        table.add_row(rank.name, rank.formula, str(rank.parameters), f"{rank.mean:.4f}")
    return table


def _specimen_table(result: StiffnessResult) -> Table:
    table = Table(title="the law against each specimen", box=box.SIMPLE)
    table.add_column("cable")
    for column in ("l m", "cycles", "tension N", "VAF up %", "VAF down %", "VAF mean %"):
        table.add_column(column, justify="right")
    table.add_column("E at the asymptote N/mm²")
    for one in result.specimens:
        low = min(float(b.tension.min()) for b in one.branches)
        high = max(float(b.tension.max()) for b in one.branches)
        modulus = "not reached"
        if one.asymptote is not None:
            value, (lower, upper) = one.asymptote
            modulus = interval_text(1e-6 * value, (1e-6 * lower, 1e-6 * upper))
        table.add_row(
            escape(one.specimen.label) + ("" if one.fitted else ", not fitted"),
            f"{one.specimen.length:.3f}",
            str(one.ramps.cycles),
            f"{low:.2f} … {high:.2f}",
            *(f"{one.vaf[name]:.3f}" for name in (UP, DOWN, MEAN)),
            modulus,
        )
    return table


def _hysteresis_table(result: StiffnessResult) -> Table:
    table = Table(title="hysteresis: half the gap between up and down", box=box.SIMPLE)
    table.add_column("cable")
    for column in ("half width N", "of it damper N", "visible from N", "energy lost %"):
        table.add_column(column, justify="right")
    table.add_column("")
    for one in result.specimens:
        found = one.hysteresis
        rest = found.half_width - found.viscous
        verdict = f"{rest:.3g} N of hysteresis" if found.seen else "below what can be seen"
        table.add_row(
            escape(one.specimen.label),
            interval_text(found.half_width, found.interval, 3),
            f"{found.viscous:.3g}",
            f"{found.limit:.2g}",
            f"{100.0 * found.loss:.3f}",
            verdict,
        )
    return table
