"""Run several scenarios, or one under several controllers, side by side."""

from __future__ import annotations

import contextlib
import multiprocessing
from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace
from json import dumps
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.changed_machine import of_testbed
from cspm.commands.progress_shown import shown
from cspm.commands.run_command import bundle_from
from cspm.summary_files import summarise
from cspm_msgs_py.control_spec.motion_laws import MOTION_LAWS
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.scenario import (
    ClosedLoop,
    MotionLaw,
    Requirement,
    Scenario,
    load_scenario,
)
from cspm_msgs_py.schedule import MOTION_CONTROLLER
from cspm_run.bundle import Bundle
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_run.output.summary import summary_data, warned
from cspm_run.recorded_run import run
from cspm_run.run_result import RunResult
from cspm_run.stage_warm_up import compile_apart, is_compiled

PICTURE = "runs.png"
REFRESH_S = 0.2
# What every motion controller has.
SHARED_KEYS = ("control.motion.dofs", "control.motion.design_pose")


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
        laws: motion controllers to run one scenario under; none: the scenario's own.
    """

    overrides: Sequence[str] = ()
    folder: Path | None = None
    json: Path | None = None
    plant: str = SIM
    machine: Path | None = None
    effects: Sequence[str] = ()
    laws: Sequence[str] = ()


def run_beside_command(paths: Sequence[Path], settings: Settings) -> bool:
    """Run scenario files, a process each, and show them side by side.

    Returns:
        Whether all ran to their ends.

    Raises:
        InputError: two have the same name, their machines have other cables, or the scenario
            cannot run under the controllers.
        CspmError: a run diverged; recordings and picture are kept.
    """
    console = make_console()
    bundles = _bundles(paths, settings)
    refuse_existing(settings.folder)
    if settings.folder is not None:
        settings.folder.mkdir(parents=True)
    results = _run_all(bundles, settings.folder, console)
    _show(console, results, next(iter(bundles.values())).scenario.requirement)
    data = {name: summary_data(result) for name, result in results.items()}
    if settings.json is not None:
        write_json(settings.json, data)
    if settings.folder is not None:
        _draw(bundles, results, settings.folder)
        write_json(settings.folder / "summary.json", data)
        say(console, f"recordings and picture {PICTURE} in {settings.folder}")
    say(console, _next_step(results, settings))
    failed = [f"{name}: {each.failure}" for name, each in results.items() if each.failure]
    if failed:
        raise CspmError("; ".join(failed))
    return not any(result.interrupted for result in results.values())


def _bundles(paths: Sequence[Path], settings: Settings) -> dict[str, Bundle]:
    """Return what is run, by the name of scenario or controller."""
    rest = settings.machine, settings.plant, settings.effects
    if settings.laws:
        changes = under_laws(paths, settings.overrides, settings.laws)
        return {law: bundle_from(paths[0], more, *rest) for law, more in changes.items()}
    bundles = [bundle_from(path, settings.overrides, *rest) for path in paths]
    _check_comparable(bundles)
    return {bundle.scenario.name: bundle for bundle in bundles}


def under_laws(
    paths: Sequence[Path], overrides: Sequence[str], laws: Sequence[str]
) -> dict[str, list[str]]:
    """Return the overrides by which one scenario runs under each motion controller.

    The scenario's own controller keeps its settings. The others have the defaults, with the same
    `dofs` and `design_pose`.

    Raises:
        InputError: no such controller, one named twice, several scenarios, one without a motion
            controller of that choice, or overrides that choose the controller too.
    """
    _check_laws(paths, overrides, laws)
    motion = _replaceable(load_scenario(paths[0], of_testbed(overrides)[0]))
    kept = motion.model_dump(mode="json", include={"dofs", "design_pose"})
    found = {}
    for law in laws:
        change = f"control.motion={dumps({'law': law} | kept)}"
        found[law] = [*overrides, *([] if law == motion.law else [change])]
    return found


def _replaceable(scenario: Scenario) -> MotionLaw:
    """Return the motion controller that others may take the place of."""
    control = scenario.control
    own = MOTION_CONTROLLER in scenario.controllers
    if isinstance(control, ClosedLoop) and not own:
        return control.motion
    has = "one of its own" if own else f"none in mode {control.mode}"
    raise InputError(
        f"--controllers: scenario {scenario.name} has {has}, allowed: a scenario in mode"
        f" closed_loop without controllers.{MOTION_CONTROLLER}"
    )


def _check_laws(paths: Sequence[Path], overrides: Sequence[str], laws: Sequence[str]) -> None:
    for law in laws:
        if law not in MOTION_LAWS:
            raise InputError(f"--controllers {law}: allowed: {', '.join(MOTION_LAWS)}")
        if laws.count(law) > 1:
            raise InputError(f"--controllers {law}: named twice, allowed: once each")
    if len(paths) > 1:
        raise InputError(f"--controllers: with {len(paths)} scenarios, allowed: with one scenario")
    for override in overrides:
        key = override.partition("=")[0]
        within = key == "control" or f"{key}.".startswith("control.motion.")
        if within and key not in SHARED_KEYS:
            raise InputError(
                f"--set {override}: with --controllers, which sets it too, allowed: only one of"
                f" them, or {' and '.join(SHARED_KEYS)}"
            )


def _show(console: Console, results: Mapping[str, RunResult], requirement: Requirement) -> None:
    console.print(beside_table(results, requirement))
    for name, result in results.items():
        for line in warned(result):
            say(console, f"warning: {name}: {line}")


def beside_table(results: Mapping[str, RunResult], requirement: Requirement) -> Table:
    """Return errors per coordinate, tensions and shares of all runs, a pair of columns each."""
    first = next(iter(results.values()))
    of = "" if first.scenario in results else f"{escape(first.scenario)}, "
    table = Table(title=f"{of}seed {first.seed}: reference − pose, largest and RMS")
    table.add_column("")
    table.add_column("required", justify="right")
    for name in results:
        table.add_column(escape(name), justify="right", overflow="fold")
    rows = [summary_data(result) for result in results.values()]
    for i, dof in enumerate(DOFS):
        limit, unit = (requirement.position, "mm") if i < 3 else (requirement.angle, "mrad")
        cells = [_error(row["errors"][dof], limit, unit) for row in rows]
        table.add_row(dof, f"± {1e3 * limit:g} {unit}", *cells)
    table.add_section()
    ranges = [f"{row['tension']['min']:.2f} to {row['tension']['max']:.1f} N" for row in rows]
    table.add_row("tensions", "", *ranges)
    table.add_row("wrench infeasible", "", *(f"{row['infeasible_share']:.1%}" for row in rows))
    return table


def _error(error: dict[str, float], limit: float, unit: str) -> str:
    colour = "green" if error["max"] <= limit else "yellow" if error["rms"] <= limit else "red"
    return f"[{colour}]{1e3 * error['max']:.3g}, {1e3 * error['rms']:.3g} {unit}[/]"


def _next_step(results: Mapping[str, RunResult], settings: Settings) -> str:
    """Return what to try after this."""
    names, folder = list(results), settings.folder
    words = " ".join(names)
    if settings.laws:
        words = f"{results[names[0]].scenario} --controllers {','.join(names)}"
    again = f"next: `cspm run {words} --seed 2`, another sea of the same kind"
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


def _run_all(
    bundles: Mapping[str, Bundle], folder: Path | None, console: Console
) -> dict[str, RunResult]:
    context = multiprocessing.get_context("spawn")
    with (
        context.Manager() as manager,
        ProcessPoolExecutor(len(bundles), mp_context=context) as pool,
        shown(console, "simulating") as progress,
    ):
        if not is_compiled():
            progress(0.0, "compiling, once")
            # What fails here the run itself reports.
            wait(compile_apart(list(bundles.values()), pool))
        reached: MutableMapping[str, float] = manager.dict()
        futures = {
            name: pool.submit(_run_one, name, bundle, folder, reached)
            for name, bundle in bundles.items()
        }
        while not all(future.done() for future in futures.values()):
            _wait(list(futures.values()))
            shares = [reached.get(n, 0.0) / b.scenario.duration for n, b in bundles.items()]
            progress(sum(shares) / len(shares), ", ".join(bundles))
    return {name: future.result() for name, future in futures.items()}


def _wait(futures: Sequence[Future[RunResult]]) -> None:
    """Wait a little for the first that is not done; Ctrl-C is the runs' to answer."""
    left = next(future for future in futures if not future.done())
    with contextlib.suppress(TimeoutError, KeyboardInterrupt):
        left.exception(REFRESH_S)


def _run_one(
    name: str, bundle: Bundle, folder: Path | None, reached: MutableMapping[str, float]
) -> RunResult:
    def show(now: float) -> None:
        reached[name] = now

    return run(bundle, folder and folder / name, show)


def _draw(bundles: Mapping[str, Bundle], results: Mapping[str, RunResult], folder: Path) -> None:
    # As loading matplotlib in `summarise`.
    from cspm.plots.runs_figure import draw_runs

    for name, result in results.items():
        assert result.folder is not None
        summarise(result.folder, bundles[name], result)
    first = next(iter(bundles.values()))
    draw_runs(
        folder / PICTURE,
        [replace(result, scenario=name) for name, result in results.items()],
        first.scenario.requirement,
        first.testbed.testbed.cable_names,
        [1.0 / bundle.scenario.rates.plant for bundle in bundles.values()],
    )
