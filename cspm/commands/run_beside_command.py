"""Run several scenarios side by side: one table, one picture."""

from __future__ import annotations

import contextlib
import multiprocessing
from collections.abc import MutableMapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from cspm.commands.run_command import bundle_from, summarise
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.scenario import Requirement
from cspm_run.bundle import Bundle
from cspm_run.console import make_console, say
from cspm_run.plants import SIM
from cspm_run.recorded_run import run
from cspm_run.run_result import RunResult
from cspm_run.stage_warm_up import compile_apart, is_compiled
from cspm_run.summary import summary_data, write_json

PICTURE = "runs.png"
REFRESH_S = 0.2


@dataclass(frozen=True)
class Settings:
    """What all runs share.

    Attributes:
        overrides: replaced values of each scenario, `KEY=VALUE`.
        folder: a new folder for recordings and picture; None records and draws nothing.
        json: file for the printed results; None writes none.
        plant: the plant's equations.
        machine: a test-bed file instead of each scenario's.
        effects: physics planted in each machine.
    """

    overrides: Sequence[str] = ()
    folder: Path | None = None
    json: Path | None = None
    plant: str = SIM
    machine: Path | None = None
    effects: Sequence[str] = ()


def run_beside_command(paths: Sequence[Path], settings: Settings) -> bool:
    """Run scenario files, a process each, and show them side by side.

    Returns:
        Whether all ran to their ends.

    Raises:
        InputError: two have the same name, or their machines have other cables.
        CspmError: a run diverged; recordings and picture are kept.
    """
    console = make_console()
    bundles = [
        bundle_from(path, settings.overrides, settings.machine, settings.plant, settings.effects)
        for path in paths
    ]
    _check_comparable(bundles)
    refuse_existing(settings.folder)
    if settings.folder is not None:
        settings.folder.mkdir(parents=True)
    results = _run_all(bundles, settings.folder, console)
    requirement = bundles[0].scenario.requirement
    _show(console, results, requirement)
    data = {result.scenario: summary_data(result) for result in results}
    if settings.json is not None:
        write_json(settings.json, data)
    if settings.folder is not None:
        _draw(bundles, results, settings.folder)
        write_json(settings.folder / "summary.json", data)
        say(console, f"recordings and picture {PICTURE} in {settings.folder}")
    say(console, _next_step(results, settings.folder))
    failed = [f"{each.scenario}: {each.failure}" for each in results if each.failure]
    if failed:
        raise CspmError("; ".join(failed))
    return not any(result.interrupted for result in results)


def _show(console: Console, results: Sequence[RunResult], requirement: Requirement) -> None:
    console.print(beside_table(results, requirement))
    for result in results:
        for line in result.warnings:
            say(console, f"warning: {result.scenario}: {line}")


def beside_table(results: Sequence[RunResult], requirement: Requirement) -> Table:
    """Return errors per coordinate, tensions and shares of all runs, a pair of columns each."""
    table = Table(title=f"seed {results[0].seed}: reference − pose, largest and RMS")
    table.add_column("")
    table.add_column("required", justify="right")
    for result in results:
        table.add_column(escape(result.scenario), justify="right", overflow="fold")
    rows = [summary_data(result) for result in results]
    for i, dof in enumerate(DOFS):
        limit, unit = (requirement.position, "mm") if i < 3 else (requirement.angle, "mrad")
        cells = [_error(row["errors"][dof], limit, unit) for row in rows]
        table.add_row(dof, f"± {1e3 * limit:g} {unit}", *cells)
    table.add_section()
    ranges = [f"{row['tension']['min']:.2f} to {row['tension']['max']:.1f} N" for row in rows]
    table.add_row("tensions", "", *ranges)
    table.add_row("wrench not met", "", *(f"{row['infeasible_share']:.1%}" for row in rows))
    return table


def _error(error: dict[str, float], limit: float, unit: str) -> str:
    colour = "green" if error["max"] <= limit else "yellow" if error["rms"] <= limit else "red"
    return f"[{colour}]{1e3 * error['max']:.3g}, {1e3 * error['rms']:.3g} {unit}[/]"


def _next_step(results: Sequence[RunResult], folder: Path | None) -> str:
    """Return what to try after this."""
    names = [result.scenario for result in results]
    again = f"next: `cspm run {' '.join(names)} --seed 2`, another sea of the same kind"
    if folder is None:
        return again
    return f"{again}; `cspm info {folder / names[-1]}` lists what was recorded"


def _check_comparable(bundles: Sequence[Bundle]) -> None:
    names = [bundle.scenario.name for bundle in bundles]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"scenario {twice[0]}: named twice, allowed: once each")
    for bundle in bundles[1:]:
        if bundle.testbed.testbed.cable_names != bundles[0].testbed.testbed.cable_names:
            raise InputError(
                f"scenarios {names[0]} and {bundle.scenario.name}: machines with other cables,"
                " allowed: machines with the same, or one scenario at a time"
            )


def _run_all(bundles: Sequence[Bundle], folder: Path | None, console: Console) -> list[RunResult]:
    context = multiprocessing.get_context("spawn")
    columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()
    with (
        context.Manager() as manager,
        ProcessPoolExecutor(len(bundles), mp_context=context) as pool,
        Progress(*columns, console=console, transient=True) as bar,
    ):
        if not is_compiled():
            _compile(bundles, pool, bar)
        reached: MutableMapping[str, float] = manager.dict()
        tasks = {b.scenario.name: bar.add_task(escape(b.scenario.name)) for b in bundles}
        futures = [pool.submit(_run_one, each, folder, reached) for each in bundles]
        while not all(future.done() for future in futures):
            _wait(futures)
            for bundle in bundles:
                name, total = bundle.scenario.name, bundle.scenario.duration
                bar.update(tasks[name], completed=reached.get(name, 0.0), total=total)
    return [future.result() for future in futures]


def _compile(bundles: Sequence[Bundle], pool: ProcessPoolExecutor, bar: Progress) -> None:
    task = bar.add_task("compiling, once", total=None)
    # What fails here the run itself reports.
    wait(compile_apart(bundles, pool))
    bar.remove_task(task)


def _wait(futures: Sequence[Future[RunResult]]) -> None:
    """Wait a little for the first that is not done; Ctrl-C is the runs' to answer."""
    left = next(future for future in futures if not future.done())
    with contextlib.suppress(TimeoutError, KeyboardInterrupt):
        left.exception(REFRESH_S)


def _run_one(bundle: Bundle, folder: Path | None, reached: MutableMapping[str, float]) -> RunResult:
    name = bundle.scenario.name

    def show(now: float) -> None:
        reached[name] = now

    return run(bundle, folder and folder / name, show)


def _draw(bundles: Sequence[Bundle], results: Sequence[RunResult], folder: Path) -> None:
    # As loading matplotlib in `summarise`.
    from cspm.plots.runs_figure import draw_runs

    for bundle, result in zip(bundles, results, strict=True):
        assert result.folder is not None
        summarise(result.folder, bundle, result)
    draw_runs(
        folder / PICTURE,
        results,
        bundles[0].scenario.requirement,
        bundles[0].testbed.testbed.cable_names,
        [1.0 / bundle.scenario.rates.plant for bundle in bundles],
    )
