"""A run from start to end: assemble, step, record, and return its statistics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

from cspm_msgs_py.diagnostics import Level, Status, encode_diagnostics
from cspm_msgs_py.errors import ControllerError, DivergenceError
from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.recording.run_record import CONTRACT_VERSION, OWN_CONTROLLERS, OWN_NODE
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.schedule import schedule_of
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_run.assembly import Assembly, assemble
from cspm_run.bundle import Bundle
from cspm_run.compiled.compiled_loop import TakeBlock
from cspm_run.controlled_dofs import controlled_dofs
from cspm_run.loop import Loop
from cspm_run.plants import recorded_plant
from cspm_run.recorded_scene import RecordedScene
from cspm_run.run_result import RunResult
from cspm_run.run_statistics import RunStatistics
from cspm_run.stability.run_warnings import limits_met, run_warnings
from cspm_run.stepping import Stepping
from cspm_sim.simulator import Publish

INPROCESS = "inprocess"


class Recorder(Protocol):
    """What takes a run's messages: a recording, or memory."""

    @property
    def folder(self) -> Path | None:
        """Where the recording is, if there is one."""

    @property
    def counts(self) -> dict[str, int]:
        """How many messages were taken, by topic; complete once closed."""

    def takes(self, name: str) -> bool:
        """Return whether messages of a topic are taken."""

    def channel(self, name: str) -> TakesRows:
        """Return what takes the messages of a topic with rows."""

    def append_payload(self, name: str, log_ns: int, payload: bytes) -> None:
        """Take a message of a topic without rows."""

    def close(self) -> None:
        """Take no more."""


class TakesRows(Protocol):
    """What takes the messages of one topic."""

    @property
    def append(self) -> Publish:
        """Takes log time and stamp [ns], and the row."""

    @property
    def append_rows(self) -> TakeBlock:
        """Takes log times and stamps [ns], and the rows' bytes."""


def run(
    bundle: Bundle,
    folder: Path | None,
    progress: Callable[[float], None] = lambda _: None,
    *,
    steps: int | None = None,
    hardware_id: str | None = None,
) -> RunResult:
    """Run a scenario in this process.

    Args:
        bundle: what to run, resolved.
        folder: where to record; None records nothing.
        progress: called now and then with the time simulated so far [s].
        steps: end after so many plant steps; None runs the scenario's duration.
        hardware_id: in statuses; None for the machine's name.

    Raises:
        InputError: scenario and test-bed do not fit, or the folder exists.
        ConvergenceError: the bar cannot hang where the scenario starts.
    """
    parts = parts_of(bundle)
    steps = steps or steps_of(bundle)
    if folder is None:
        return simulate(parts, None, progress, steps, hardware_id)
    with new_recording(bundle, folder, INPROCESS) as writer:
        return simulate(parts, writer, progress, steps, hardware_id)


def parts_of(bundle: Bundle) -> Assembly:
    """Return what a run steps.

    Raises:
        InputError: scenario and test-bed do not fit.
        ConvergenceError: the bar cannot hang where the scenario starts.
    """
    with bundle.unpacked() as place:
        return assemble(bundle.scenario, bundle.testbed.testbed, place, bundle.plant)


def steps_of(bundle: Bundle) -> int:
    """Return how many steps of the plant the scenario lasts."""
    return round(bundle.scenario.duration * bundle.scenario.rates.plant)


def new_recording(
    bundle: Bundle, folder: Path, mode: str, own_nodes: Sequence[str] = ()
) -> RecordingWriter:
    """Return the recording that a run by the schedule fills.

    Raises:
        InputError: the folder exists or cannot be created.
    """
    return recording_of(bundle, folder, mode, recorded_topics(bundle), own_nodes)


def recording_of(
    bundle: Bundle,
    folder: Path,
    mode: str,
    topics: Mapping[str, Topic],
    own_nodes: Sequence[str] = (),
) -> RecordingWriter:
    """Return a new recording of these topics that carries the run's description.

    `own_nodes` are controllers that are ROS programs of the user's.

    Raises:
        InputError: the folder exists or cannot be created.
    """
    return RecordingWriter(
        folder,
        topics,
        attachments=bundle.attachments(),
        metadata=metadata(bundle, mode, own_nodes),
        derived=RecordedScene(bundle.testbed.testbed, topics),
    )


def recorded_topics(bundle: Bundle) -> dict[str, Topic]:
    """Return the topics that a run publishes, in contract order."""
    testbed = bundle.testbed.testbed
    published = {*schedule_of(bundle.scenario, testbed).topics, DIAGNOSTICS.name}
    return {name: topic for name, topic in testbed.topics.items() if name in published}


def metadata(bundle: Bundle, mode: str, own_nodes: Sequence[str] = ()) -> dict[str, str]:
    """Return the metadata record of the recording of a run in a mode."""
    own: dict[str, str] = {
        stage: each.class_name for stage, each in bundle.scenario.controllers.items()
    }
    own |= dict.fromkeys(own_nodes, OWN_NODE)
    named = ", ".join(f"{stage}: {what}" for stage, what in own.items())
    return ({OWN_CONTROLLERS: named} if own else {}) | {
        "contract_version": CONTRACT_VERSION,
        "scenario": bundle.scenario.name,
        "seed": str(bundle.scenario.seed),
        "mode": mode,
        **recorded_plant(bundle.plant),
        "package_version": version("cspm"),
        "testbed": bundle.described.testbed.name,
        "testbed_sha256": bundle.described.sha256,
    }


def simulate(
    parts: Assembly,
    writer: Recorder | None,
    progress: Callable[[float], None],
    steps: int,
    hardware_id: str | None = None,
) -> RunResult:
    """Step assembled parts to the end, and return the statistics; see `run`.

    Args:
        parts: what to step.
        writer: takes topics of the parts' schedule; None records nothing.
        progress: called now and then with the time simulated so far [s].
        steps: of the plant.
        hardware_id: in statuses; None for the machine's name.
    """
    scenario, plant = parts.scenario, parts.plant
    statistics = RunStatistics(steps, len(plant.tensions), parts.period_ns * 1e-9)
    publish: Mapping[str, Publish] = {}
    take: Mapping[str, TakeBlock] = {}
    if writer is not None:
        names = [name for name in parts.schedule.topics if writer.takes(name)]
        channels = {name: writer.channel(name) for name in names}
        publish = {name: channel.append for name, channel in channels.items()}
        take = {name: channel.append_rows for name, channel in channels.items()}

    alarms: list[str] = []
    named = parts.testbed.name if hardware_id is None else hardware_id

    def publish_status(now_ns: int, status: Status) -> None:
        if status.level == Level.ERROR and not alarms:
            alarms.append(f"{status.name}: {status.message}")
        if writer is not None and writer.takes(DIAGNOSTICS.name):
            payload = encode_diagnostics(now_ns, [status], named)
            writer.append_payload(DIAGNOSTICS.name, now_ns, payload)

    loop = Loop(parts, publish, publish_status)
    stepping, failure = Stepping(loop, statistics, take, steps), None
    with interruptible() as interrupted:
        try:
            stepping.run(progress, interrupted)
        except DivergenceError as err:
            failure = f"{err}; {stepping.history()}"
        except ControllerError as err:
            failure = str(err)
        stopped = interrupted()
    if writer is not None:
        writer.close()
    return RunResult(
        scenario=scenario.name,
        seed=scenario.seed,
        mode=INPROCESS,
        simulated=plant.time,
        elapsed=stepping.elapsed,
        statistics=statistics,
        messages=writer.counts if writer is not None else {},
        folder=writer.folder if writer is not None else None,
        controlled=controlled_dofs(scenario),
        has_bar=parts.testbed.bar is not None,
        interrupted=stopped and failure is None,
        failure=failure or (alarms[0] if alarms else None),
        warnings=run_warnings(scenario, parts.testbed, statistics),
        limits_met=limits_met(scenario, parts.testbed, statistics),
        saturation=tuple(statistics.saturation(parts.testbed.cable_names)),
    )
