"""Simulating a scenario: arrays at once, a recording on demand."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from cspm.controller import Controller, with_own
from cspm.progress import Progress, shows_progress, silent
from cspm.recorded import Recording
from cspm.reference import Reference, with_reference
from cspm.scenario import AnyScenario, Scenario, as_scenario, with_changes
from cspm.signals import Signals
from cspm.testbed import AnyTestbed, Testbed, as_file, check_plant
from cspm_control.stages.own_code import load_controller
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder, refuse_existing
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.recording.run_record import EXTERNAL, OWN_CONTROLLERS, SIM
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.testbed import TestbedFile
from cspm_msgs_py.topics import Topic
from cspm_run.assembly import resolve
from cspm_run.bundle import Bundle, make_bundle
from cspm_run.memory_recorder import MemoryRecorder
from cspm_run.output.json_file import write_json
from cspm_run.output.summary import summary_data
from cspm_run.plants import PLANTS, check_plant_name, check_unit_mode, refuse_cuts
from cspm_run.recorded_run import (
    INPROCESS,
    metadata,
    parts_of,
    recorded_topics,
    steps_of,
)
from cspm_run.recorded_run import simulate as step_through
from cspm_run.recorded_scene import RecordedScene
from cspm_run.run_result import RunResult

if TYPE_CHECKING:
    from cspm_ros.margins.rehearsal import Variant

GRAPH, PROCESSES, REALTIME = "graph", "processes", "realtime"
MODES = (INPROCESS, GRAPH, PROCESSES, REALTIME)
Runner: TypeAlias = Callable[[Bundle, Path, Callable[[float], None]], RunResult]


class Run(Signals):
    """What was simulated, as arrays; `save` makes a recording of it.

    Examples:
        >>> import cspm
        >>> run = cspm.simulate("rest", duration=0.1)
        >>> run.tension["sway_3"].shape, run.bar_pose["heave"].shape, run.bar_pose.time.shape
        ((100,), (10,), (10,))

    Attributes:
        testbed: the machine that was simulated.
        failure: what went wrong, in one line: the run ended there. None: nothing did.
        interrupted: whether Ctrl-C ended it early.
    """

    def __init__(
        self,
        bundle: Bundle,
        result: RunResult,
        source: MemoryRecorder | Recording,
        about: Mapping[str, str],
        place: ScratchFolder | None = None,
        *,
        partial: bool = False,
    ) -> None:
        """Take what was run, what it amounted to, its messages, and its metadata record.

        `place` has the messages, and is removed when the run is not used any more.
        `partial` says that some of the messages were not kept.
        """
        self._partial = partial
        self.testbed = Testbed(bundle.testbed)
        self.failure = result.failure
        self.interrupted = result.interrupted
        self._bundle, self._result, self._source = bundle, result, source
        self._about = about
        self._place = place

    @property
    def duration(self) -> float:
        """Time that was simulated [s]."""
        return self._result.simulated

    @property
    def alarms(self) -> tuple[str, ...]:
        """Return the lines of `summary["warnings"]` but that on the time spent at limits."""
        return self._result.warnings

    @property
    def summary(self) -> dict[str, Any]:
        """Return what `summary.json` holds; see `docs/reference/contract.md`."""
        return summary_data(self._result)

    @property
    def errors(self) -> dict[str, dict[str, float]]:
        """Pose errors of the bar against its reference, `max` and `rms` by DOF [m, rad]."""
        found: dict[str, dict[str, float]] = self.summary["errors"]
        return found

    def save(self, folder: str | Path) -> Recording:
        """Write a recording, with its `summary.json`, and return it.

        Args:
            folder: a new one; its name becomes the recording's.

        Raises:
            InputError: the folder exists or cannot be written, or not every signal was kept.
        """
        if self._partial:
            raise InputError(
                f"{folder}: the run keeps but some signals, allowed: one that keeps all"
            )
        place = Path(folder)
        refuse_existing(place)
        if isinstance(self._source, Recording):
            shutil.copytree(self._source.path, place)
        else:
            topics = self._source.topics
            with RecordingWriter(
                place,
                topics,
                attachments=self._bundle.attachments(),
                metadata=self._about,
                derived=RecordedScene(self._bundle.testbed.testbed, topics),
            ) as writer:
                self._source.write_to(writer)
        write_json(place / "summary.json", self.summary)
        return Recording(place)

    def draw(self, path: str | Path) -> None:
        """Draw errors and tensions over time into a new picture.

        Raises:
            InputError: the file exists.
        """
        refuse_existing(Path(path))
        from cspm.plots.run_figure import draw_run

        scenario = self._bundle.scenario
        period = 1.0 / scenario.rates.plant
        draw_run(Path(path), self._result, scenario.requirement, self.testbed.cables, period)

    def _topics(self) -> tuple[str, ...]:
        if isinstance(self._source, Recording):
            return self._source.topics
        return tuple(name for name, count in self._source.counts.items() if count)

    def _read(self, name: str) -> tuple[Topic, Rows]:
        if isinstance(self._source, Recording):
            return self._source._read(name)
        rows = self._source.rows(name)
        return self._source.topics[name], rows

    def _start_ns(self) -> int:
        return self._source._start_ns() if isinstance(self._source, Recording) else 0

    def __repr__(self) -> str:
        end = "" if self.failure is None else f", failed: {self.failure}"
        return f"Run({self._bundle.scenario.name!r}, {self.duration:g} s{end})"


@shows_progress("simulating")
def simulate(
    scenario: AnyScenario,
    *,
    testbed: AnyTestbed | None = None,
    duration: float | None = None,
    seed: int | None = None,
    controllers: Mapping[str, Controller] | None = None,
    reference: Reference | None = None,
    plant: str = SIM,
    mode: str = INPROCESS,
    anyway: bool = False,
    progress: Progress = silent,
) -> Run:
    """Simulate a scenario and return its signals.

    The same scenario, seed and machine give the same run, bit for bit.

    Args:
        scenario: a name such as `calm`, a file, or a `Scenario`.
        testbed: another machine than the scenario's: a name, a file, or a `Testbed`.
        duration: simulated time [s] instead of the scenario's.
        seed: of waves and sensor noise, instead of the scenario's.
        controllers: of one's own, by stage; see `Controller`. In this process only.
        reference: another motion for the bar to follow: a function of time [s] that returns a pose
            x y z φ θ ψ in world_ned [m, rad], or times (n,) and poses (n, 6).
        plant: whose equations: `sim`, or `mujoco`, a second implementation; in this process also
            the file of a unit of FMI 2, in real time also `external`, somebody's drivers.
        mode: `inprocess`, without ROS; `graph`, ROS 2 nodes in one process; `processes`, a process
            per node; these three give the same messages. `realtime`: nodes paced by the clock.
        anyway: in real time with a simulated plant, begin without a look at how late the machine
            is.
        progress: called now and then with the share that is done and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: no such scenario or test-bed, a value that is not allowed, or scenario and
            test-bed that do not fit.
        CspmError: the bar cannot hang where the scenario starts, or a node failed.

    Warns:
        RuntimeWarning: the run failed on its way, as `Run.failure` has it; what there is up to then
            is returned.
        UserWarning: a cable carried, or may carry, more than its breaking force allows; the loops
            are not stable, or a limit cycle stayed.

    Examples:
        >>> import cspm
        >>> run = cspm.simulate("calm", duration=0.5, seed=2)
        >>> float(run.time[-1])
        0.499
    """
    _check_choices(plant, mode, bool(controllers))
    check_anyway(plant, mode, anyway=anyway)
    chosen = with_changes(as_scenario(scenario), duration=duration, seed=seed)
    with ScratchFolder("reference") as place:
        if reference is not None:
            chosen = with_reference(chosen, reference, place)
        machine = None if testbed is None else as_file(testbed)
        bundle = bundle_of(chosen, machine, plant, own=place)
    total = bundle.scenario.duration

    def show(now: float) -> None:
        progress(min(1.0, now / total), "simulating")

    if mode == INPROCESS:
        run = simulate_in_memory(bundle, controllers or {}, show)
    else:
        run = _by_nodes(bundle, mode, plant == EXTERNAL, show, progress, anyway=anyway)
    warn_of(run, stacklevel=3)
    return run


def bundle_of(
    scenario: Scenario, testbed: TestbedFile | None, plant: str, own: Path | None = None
) -> Bundle:
    """Return the self-contained description of a run.

    Args:
        scenario: as requested.
        testbed: a machine instead of the scenario's.
        plant: one of `PLANTS`, a unit's file, or `external`.
        own: a folder of motions that the caller wrote, beside the scenario's.

    Raises:
        InputError: scenario and test-bed do not fit, or an effect is not possible.
    """
    machine = scenario.testbed_file if testbed is None else testbed
    check_plant(machine)
    resolved = resolve(scenario.description, machine.testbed, scenario.path.parent)
    if plant == EXTERNAL:
        refuse_cuts(EXTERNAL, resolved.events)
    bundle = make_bundle(resolved, machine, scenario.path.parent, own)
    if bundle.scenario.controllers:
        # Before anything is recorded, and in every mode.
        with bundle.unpacked() as place:
            for stage, named in bundle.scenario.controllers.items():
                load_controller(stage, named, place)
    return replace(bundle, plant=SIM if plant == EXTERNAL else plant)


def ros_runner(
    mode: str,
    notify: Callable[[str], None],
    *,
    external: bool,
    apart: bool,
    patience_s: float,
    needed_by: str,
    own_nodes: Sequence[str] = (),
    anyway: bool = False,
    variant: Variant | None = None,
) -> Runner:
    """Return what runs a scenario in a mode that needs ROS; only now is ROS loaded.

    Args:
        mode: one of `MODES` but the first.
        notify: called with what is being waited for, and with nothing once all is there.
        external: whether somebody's drivers take the plant's place.
        apart: in real time, whether each node has a process of its own.
        patience_s: how long nothing may move [s].
        needed_by: what needs ROS, for the error.
        own_nodes: in processes, controllers that are programs of the user's, by node name.
        anyway: in real time, begin without a look at how late the machine is.
        variant: in real time, returns what is run with more values put over the scenario's.

    Raises:
        InputError: ROS is not installed.
    """
    from cspm_ros.runtime.ros_install import find_ros

    find_ros(needed_by)
    if mode == GRAPH:
        from cspm_ros.runtime.graph_run import run_graph

        return partial(run_graph, patience_s=patience_s)
    if mode != REALTIME or apart:
        from cspm_ros.runtime.process_run import run_processes

        runner = partial(run_processes, mode=mode, own_nodes=own_nodes)
    else:
        from cspm_ros.runtime.realtime_run import run_realtime

        runner = partial(run_realtime)
    runner = partial(runner, external=external, notify=notify, patience_s=patience_s)
    if mode != REALTIME or anyway:
        return runner
    from cspm_ros.margins.rehearsal import rehearsed

    return rehearsed(runner, notify, variant)


def warn_of(run: Run, *, stacklevel: int) -> None:
    """Warn of what went wrong with a run; `stacklevel` counts from this function's caller."""
    name = run.summary["scenario"]
    if run.failure is not None:
        warnings.warn(f"{name}: {run.failure}", RuntimeWarning, stacklevel=stacklevel)
    for line in run.alarms:
        warnings.warn(f"{name}: {line}", UserWarning, stacklevel=stacklevel)


def check_anyway(plant: str, mode: str, option: str = "anyway", *, anyway: bool) -> None:
    """Refuse to leave the look at the machine out where a bar may fall, or where there is none.

    Raises:
        InputError: in one line, naming the `option`.
    """
    if anyway and mode != REALTIME:
        raise InputError(f"{option} in mode {mode}: allowed: mode {REALTIME}")
    if anyway and plant == EXTERNAL:
        raise InputError(f"{option} with plant {EXTERNAL}: allowed: {', '.join(PLANTS)}")


def _check_choices(plant: str, mode: str, own: bool) -> None:
    if mode not in MODES:
        raise InputError(f"mode {mode}: allowed: {', '.join(MODES)}")
    check_plant_name(plant, "plant", more=[EXTERNAL])
    check_unit_mode(plant, mode, "plant", INPROCESS)
    if plant == EXTERNAL and mode != REALTIME:
        raise InputError(f"plant {EXTERNAL} in mode {mode}: allowed: mode {REALTIME}")
    if own and mode != INPROCESS:
        raise InputError(f"controllers in mode {mode}: allowed: mode {INPROCESS}")


def simulate_in_memory(
    bundle: Bundle,
    controllers: Mapping[str, Controller],
    show: Callable[[float], None],
    kept: Collection[str] | None = None,
) -> Run:
    """Return the run of a bundle in this process.

    Args:
        bundle: what to run.
        controllers: of one's own, by stage.
        show: called now and then with the time simulated so far [s].
        kept: topics that the run keeps; None: all.

    Raises:
        InputError: scenario and test-bed do not fit, or no such stage or topic.
        ConvergenceError: the bar cannot hang where the scenario starts.
    """
    parts = parts_of(bundle)
    stages = with_own(parts.stages, controllers, parts.testbed, parts.schedule)
    recorder = MemoryRecorder(_chosen(recorded_topics(bundle), kept))
    result = step_through(replace(parts, stages=stages), recorder, show, steps_of(bundle))
    about = metadata(bundle, INPROCESS)
    if controllers:
        names = [f"{node}: {type(each).__name__}" for node, each in controllers.items()]
        about[OWN_CONTROLLERS] = ", ".join(names)
    return Run(bundle, result, recorder, about, partial=kept is not None)


def _chosen(topics: dict[str, Topic], kept: Collection[str] | None) -> dict[str, Topic]:
    if kept is None:
        return topics
    for name in kept:
        if name not in topics:
            raise InputError(f"signals: {name}, allowed: {', '.join(topics)}")
    return {name: topic for name, topic in topics.items() if name in kept}


def _by_nodes(
    bundle: Bundle,
    mode: str,
    external: bool,
    show: Callable[[float], None],
    progress: Progress,
    *,
    anyway: bool,
) -> Run:
    """Run nodes, which record; the recording lives as long as the run that is returned."""

    def wait(what: str) -> None:
        progress(0.0, what or "all is there")

    from cspm_ros.runtime.stall_watchdog import PATIENCE_S

    runner = ros_runner(
        mode,
        wait,
        external=external,
        apart=False,
        patience_s=PATIENCE_S,
        needed_by=f"mode {mode}",
        anyway=anyway,
    )
    place = ScratchFolder("run")
    folder = place.path / bundle.scenario.name
    result = runner(bundle, folder, show)
    source = Recording(folder)
    return Run(bundle, replace(result, folder=None), source, {}, place)
