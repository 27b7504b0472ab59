"""The command `cspm identify system`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.commands.progress_shown import shown
from cspm.identification.system import identify_system
from cspm_ident.estimation import Prior
from cspm_ident.system.identification import SystemResult
from cspm_ident.system.prediction_test import Judgement
from cspm_msgs_py.dofs import DOFS
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say


@dataclass(frozen=True)
class SystemRequest:
    """Options of the command line.

    Attributes:
        recordings: to fit.
        held_out: for validation only.
        testbed: the machine's file, instead of the recorded one.
        names: parameters to fit; none for the default ones.
        frozen: fixed values by name, None for the machine's.
        priors: by name.
        bounds: lowest and highest value, by name.
        profiled: parameters whose profile likelihood is computed.
        horizon: length of the windows [s]; None for the default one.
        leave_out_regimes: whether to leave out stretches that do not belong to the rest.
        out: a new folder for picture and fitted test-bed; None writes nothing.
    """

    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...]
    testbed: Path | None
    names: tuple[str, ...]
    frozen: dict[str, float | None]
    priors: dict[str, Prior]
    bounds: dict[str, tuple[float, float]]
    profiled: tuple[str, ...]
    horizon: float | None
    out: Path | None
    leave_out_regimes: bool = False


def identify_system_command(request: SystemRequest, json: Path | None) -> bool:
    """Identify the system, print the results, and write the requested files.

    Returns whether all parameters are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    console = make_console()
    with shown(console, "reading") as progress:
        found = identify_system(
            request.recordings,
            held_out=request.held_out,
            testbed=None if request.testbed is None else named_testbed(request.testbed),
            names=request.names,
            frozen=request.frozen,
            priors=request.priors,
            bounds=request.bounds,
            profiled=request.profiled,
            horizon=request.horizon,
            leave_out_regimes=request.leave_out_regimes,
            progress=progress,
        )
    return hand_out(found, print_system, request.out, json)


def print_system(console: Console, result: SystemResult) -> None:
    """Print parameters with intervals, directions not excited, and the fit of the recordings."""
    estimate = result.solution.estimate
    table = Table(title="output error, 95 % intervals", box=box.SIMPLE)
    for column in ("parameter", "unit", "nominal", "found", ""):
        table.add_column(column, justify="right" if column == "nominal" else "left")
    for each in result.chosen:
        low, high = estimate.interval(each.name)
        value = estimate.value(each.name)
        seen = isfinite(low) and isfinite(high)
        text = interval_text(value, (low, high), 5) if seen else f"{value:.5g}"
        remark = "frozen" if each.parameter.frozen else "" if seen else "not excited"
        remark = "on its bound" if each.name in estimate.at_bound else remark
        table.add_row(each.name, each.parameter.unit, f"{each.nominal:.5g}", text, remark)
    console.print(table)
    if not result.settled:
        say(
            console,
            "values and initial states did not settle: fit fewer parameters, or freeze some",
        )
    for direction in estimate.unexcited:
        say(console, f"not excited: {direction.name}; its values are no result")
    for profile in result.profiles:
        low, high = profile.ci95
        say(console, f"profile of {profile.name}: {low:.5g} … {high:.5g} {profile.unit}")
    for name, drifts in result.drifts.items():
        for drift in drifts:
            say(console, f"{name}: {drift.topic} {drift.text}, taken out")
    for judgement in result.judgements:
        for topic, seconds in judgement.delays.items():
            name = judgement.measurement.path.name
            say(console, f"{name}: {topic} {1e3 * seconds:.1f} ms late, taken out")
    console.print(judgement_table(result.judgements))


def judgement_table(judgements: Sequence[Judgement]) -> Table:
    """Return the VAF of the bar's pose by recording, machine and degree of freedom."""
    table = Table(title="VAF of the bar's pose over the whole recording, %", box=box.SIMPLE)
    table.add_column("recording")
    table.add_column("machine")
    for dof in DOFS:
        table.add_column(dof, justify="right")
    for each in judgements:
        name = escape(each.measurement.path.name) + (", held out" if each.held_out else "")
        for label, shares in each.vaf.items():
            cells = ["still" if v is None else f"{v:.2f}" for v in shares.values()]
            table.add_row(name, label, *cells)
    return table
