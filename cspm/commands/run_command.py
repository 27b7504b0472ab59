"""The commands that run, show, restore and repeat recordings."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from cspm.changed_machine import changed_machine, of_testbed
from cspm.commands.progress_shown import shown
from cspm.progress import Progress
from cspm.scenario import Scenario
from cspm.simulation import PROCESSES, REALTIME, Runner, bundle_of, ros_runner
from cspm.summary_files import summarise
from cspm_model.cable_strength import limit_warnings
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import ScratchFolder, refuse_existing
from cspm_msgs_py.recording.run_record import EXTERNAL, SIM
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import schedule_of
from cspm_ros.runtime.stall_watchdog import PATIENCE_S, check_patience
from cspm_run.before_run import free_of, stopping_lines, unmet_line
from cspm_run.bundle import Bundle
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_run.output.summary import print_summary, summary_data
from cspm_run.recorded_run import INPROCESS, run
from cspm_run.resim import resimulate
from cspm_run.run_result import RunResult
from cspm_run.stability.run_warnings import unstable_line
from cspm_run.stage_warm_up import compile_beside

if TYPE_CHECKING:
    from cspm_ros.margins.rehearsal import Variant

# So many missing parts of a run are printed.
_MOST_GAPS = 3


def run_command(
    path: Path,
    overrides: Sequence[str],
    folder: Path | None,
    json: Path | None,
    plant: str = SIM,
    mode: str = INPROCESS,
    machine: Path | None = None,
    one_process: bool | None = None,
    patience: float | None = None,
    effects: Sequence[str] = (),
    own_nodes: Sequence[str] = (),
    anyway: bool = False,
) -> bool:
    """Run a scenario file, show the result, and return whether it ran to its end.

    Args:
        path: the scenario.
        overrides: replaced values, `KEY=VALUE`.
        folder: a new folder for the recording; None records nothing.
        json: file for the printed results; None writes none.
        plant: the plant's equations.
        mode: how to run.
        machine: a test-bed file instead of the scenario's.
        one_process: in real time, whether all nodes share a process; None for yes.
        patience: with ROS, longest stall [s]; None for the default.
        effects: physics planted in the machine, `EFFECT@ELEMENT,…:PARAMETER=VALUE,…`.
        own_nodes: controllers that are ROS programs of the user's, by node name.
        anyway: in real time, begin without a look at how late the machine is.

    Raises:
        CspmError: the run diverged, or a node failed; recording and figure are kept.
    """
    console = make_console()
    check_patience_option(patience, mode)
    bundle = bundle_from(path, overrides, machine, plant, effects)
    compile_beside(bundle)
    options = RunnerOptions(plant, mode, one_process, patience, own_nodes, anyway)
    options.check(bundle)
    refuse_existing(folder)
    runner = options.runner(
        console, lambda more: bundle_from(path, [*overrides, *more], machine, plant, effects)
    )
    testbed = bundle.testbed.testbed
    unstable = unstable_line(bundle.scenario, testbed, late=mode == REALTIME)
    for line in (*limit_warnings(testbed), *([unstable] if unstable else [])):
        say(Console(stderr=True), f"warning: {line}")
    for line in (*free_of(bundle), *stopping_lines(bundle)):
        say(console, line)
    unmet = unmet_line(bundle)
    if unmet:
        say(console, unmet)
    result = _run_with_progress(bundle, folder, console, runner)
    tell_result(console, bundle, result, json)
    if result.folder is not None:
        say(console, f"recording {result.folder}, picture {result.folder.name}/run.png")
        say(console, f"next: cspm view {shlex.quote(str(folder))}")
    if result.failure:
        diverged = result.failure.startswith("t = ")
        raise CspmError(f"diverged at {result.failure}" if diverged else result.failure)
    if result.interrupted:
        kept = "; the recording is complete so far" if result.folder else ""
        say(console, f"interrupted after {result.simulated:g} s{kept}")
    return not result.interrupted


@dataclasses.dataclass(frozen=True)
class RunnerOptions:
    """Options that decide what makes a run's steps.

    Attributes:
        plant: the plant's equations.
        mode: how to run.
        one_process: in real time, whether all nodes share a process; None for yes.
        patience: with ROS, longest stall [s]; None for the default.
        own_nodes: controllers that are ROS programs of the user's, by node name.
        anyway: in real time, begin without a look at how late the machine is.
    """

    plant: str
    mode: str
    one_process: bool | None = None
    patience: float | None = None
    own_nodes: Sequence[str] = ()
    anyway: bool = False

    def check(self, bundle: Bundle) -> None:
        """Refuse options that do not go together, or with what is run.

        Raises:
            InputError: one line.
        """
        if self.plant == EXTERNAL and self.mode != REALTIME:
            raise InputError(f"--plant {EXTERNAL} --mode {self.mode}: allowed: --mode {REALTIME}")
        if self.one_process is not None and self.mode != REALTIME:
            option = "--one-process" if self.one_process else "--process-per-node"
            raise InputError(f"{option} --mode {self.mode}: allowed: --mode {REALTIME}")
        _check_own_nodes(self.own_nodes, self.mode, bundle)

    def runner(self, console: Console, variant: Variant | None = None) -> Runner | None:
        """Return what runs a scenario as ROS nodes; None in this process, without ROS.

        `variant` returns what is run with more values put over the scenario's, `KEY=VALUE`.

        Raises:
            InputError: ROS is not installed.
        """
        if self.mode == INPROCESS:
            return None

        def notify(waiting: str) -> None:
            say(console, waiting or "all is there")

        return ros_runner(
            self.mode,
            notify,
            external=self.plant == EXTERNAL,
            apart=self.one_process is False,
            patience_s=PATIENCE_S if self.patience is None else self.patience,
            needed_by=f"--mode {self.mode}",
            own_nodes=self.own_nodes,
            anyway=self.anyway,
            variant=variant,
        )


def check_patience_option(patience: float | None, mode: str) -> None:
    """Refuse a patience that is none, or in a mode that has none.

    Raises:
        InputError: one line.
    """
    if patience is None:
        return
    check_patience(patience)
    if mode == INPROCESS:
        raise InputError(
            f"--patience --mode {mode}: allowed: --mode graph, processes or {REALTIME}"
        )


def tell_result(console: Console, bundle: Bundle, result: RunResult, json: Path | None) -> None:
    """Print what a run amounted to, write it where wanted, and put a picture beside a recording."""
    print_summary(console, result, bundle.scenario.requirement)
    if json is not None:
        write_json(json, summary_data(result))
    if result.folder is not None:
        summarise(result.folder, bundle, result)


def _check_own_nodes(names: Sequence[str], mode: str, bundle: Bundle) -> None:
    """Refuse own nodes in another mode than processes, or under names that the run does not have.

    Raises:
        InputError: one line.
    """
    if not names:
        return
    if mode != PROCESSES:
        raise InputError(f"--own-node --mode {mode}: allowed: --mode {PROCESSES}")
    possible = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes
    for name in names:
        if name not in possible:
            raise InputError(f"--own-node {name}: allowed: {', '.join(possible)}")


def bundle_from(
    path: Path,
    overrides: Sequence[str],
    machine: Path | None,
    plant: str,
    effects: Sequence[str] = (),
) -> Bundle:
    """Return what is run for a scenario file, on another or a changed machine where asked for."""
    of_scenario, own = of_testbed(overrides)
    scenario = Scenario(path, load_scenario(path, of_scenario))
    file = named_testbed(machine) if machine else scenario.testbed_file
    return bundle_of(scenario, changed_machine(file, own, effects), plant)


def resim_command(bag: Path, json: Path | None, controllers: Sequence[Path] = ()) -> bool:
    """Repeat a recorded run, and return whether every message is identical.

    `controllers` are the user's own copies of the controllers' files that took part.
    """
    console = make_console()
    what = f"repeating {bag.name}"
    with shown(console, what) as progress:
        found = resimulate(
            bag, lambda now, total: _in_seconds(progress, what, total)(now), controllers
        )
    for first, last in found.missing_s[:_MOST_GAPS]:
        say(console, f"not recorded, or not run: {first:g} to {last:g} s of the scenario")
    if len(found.missing_s) > _MOST_GAPS:
        say(console, f"and {len(found.missing_s) - _MOST_GAPS} more parts")
    if found.difference is None:
        end = "" if found.cut_ns is None else f", up to {found.cut_ns * 1e-9:g} s, where it was cut"
        say(console, f"identical: all {found.messages} messages, bit for bit{end}")
    else:
        say(console, f"different: {found.difference}")
        if not found.same_version:
            say(console, f"the recording was made by version {found.recorded_version}")
    if json is not None:
        difference = dataclasses.asdict(found.difference) if found.difference else None
        identical = {"identical": difference is None, "first_difference": difference}
        cut = None if found.cut_ns is None else found.cut_ns * 1e-9
        write_json(
            json,
            identical | {"messages": found.messages, "cut_at_s": cut, "missing_s": found.missing_s},
        )
    return found.difference is None


def _run_with_progress(
    bundle: Bundle, folder: Path | None, console: Console, runner: Runner | None
) -> RunResult:
    """Run a scenario by a runner that needs ROS, or else in this process."""
    scenario = bundle.scenario
    with shown(console, scenario.name) as progress:
        show = _in_seconds(progress, scenario.name, scenario.duration)
        if runner is None:
            return run(bundle, folder, show)
        if folder is not None:
            return runner(bundle, folder, show)
        # The result of a ROS graph is read from its recording.
        with ScratchFolder("run") as place:
            result = runner(bundle, place / scenario.name, show)
            return dataclasses.replace(result, folder=None)


def _in_seconds(progress: Progress, what: str, total: float) -> Callable[[float], None]:
    """Return what takes the time simulated so far [s] of `total`."""
    return lambda now: progress(min(1.0, now / total), f"{what}, {now:.1f} s")
