"""What `cspm identify system` does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out
from cspm.commands.identify_rig import FITTED, interval_text
from cspm_ident.estimation import Prior
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.system.choice import choose
from cspm_ident.system.fitted_file import fitted_testbed
from cspm_ident.system.identification import HORIZON, SystemResult, identify_system
from cspm_ident.system.prediction_test import Judgement
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.console import make_console, say


@dataclass(frozen=True)
class SystemRequest:
    """What was asked for on the command line.

    Attributes:
        recordings: to fit.
        held_out: to judge only.
        testbed: the machine's file, instead of what the recordings carry.
        names: parameters to fit; none for the usual ones.
        frozen: names with the value that they keep, or None for the machine's.
        priors: by name.
        bounds: lowest and highest value, by name.
        profiled: parameters whose profile likelihood is wanted.
        horizon: of the windows [s]; None for the usual one.
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


def identify_system_command(asked: SystemRequest, json: Path | None) -> None:
    """Identify, print, and write what was asked for.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or options.
    """
    console = make_console()
    refuse_existing(asked.out)
    searched, held_out = (_read(paths, asked) for paths in (asked.recordings, asked.held_out))
    chosen = choose(searched[0].machine, asked.names, asked.frozen, asked.priors, asked.bounds)
    for name in asked.profiled:
        if name not in {each.name for each in chosen if not each.parameter.frozen}:
            raise InputError(f"--profile {name}: is not fitted, allowed: a name that is")
    with console.status("") as status:
        result = identify_system(
            searched,
            chosen,
            held_out=held_out,
            profiled=asked.profiled,
            horizon=HORIZON if asked.horizon is None else asked.horizon,
            progress=lambda text: status.update(escape(text)),
        )
    hand_out(result, print_system, partial(_write, asked.testbed), asked.out, json)


def print_system(console: Console, result: SystemResult) -> None:
    """Print values with intervals, what was not excited, and how well recordings are predicted."""
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


def _read(paths: Sequence[Path], asked: SystemRequest) -> list[Measurement]:
    return [read_measurement(path, asked.testbed) for path in paths]


def _write(testbed: Path | None, folder: Path, result: SystemResult) -> dict[str, str]:
    from cspm.plots.system_figure import draw_system

    file = result.searched[0].testbed
    source = str(testbed or result.searched[0].path)
    fitted = fitted_testbed(result, file, source)
    folder.mkdir(parents=True)
    path, picture = folder / FITTED, folder / "system.png"
    path.write_text(fitted.text, encoding="utf-8")
    draw_system(picture, result.judgements)
    return {"testbed": str(path), "system": str(picture)}
