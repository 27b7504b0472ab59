"""A run from start to end: assemble, step, record, and say what it amounted to."""

from __future__ import annotations

import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from types import FrameType

import numpy as np

from cspm_bringup.assembly import Assembly, assemble
from cspm_bringup.bundle import Bundle
from cspm_bringup.loop import Loop, Publish
from cspm_bringup.tally import Tally
from cspm_msgs_py.diagnostics import Status, encode_diagnostics
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.topics import DIAGNOSTICS, Topic

CONTRACT_VERSION = "1"
PROGRESS_STEPS = 50
MODE = "inprocess"
RECORD_NAME = "cspm"


@dataclass(frozen=True)
class RunResult:
    """What a run amounted to.

    Attributes:
        scenario: the scenario's name.
        seed: of waves and sensors.
        simulated: time simulated [s].
        elapsed: wall time that took [s], without start-up and the first step.
        tally: errors and tensions.
        messages: how many messages each topic got.
        folder: the recording, if one was made.
        controlled: whether a closed loop was to follow the reference.
        has_bar: whether the errors mean anything.
        interrupted: whether the user ended it early.
        failure: what went wrong, in one line, if anything did.
    """

    scenario: str
    seed: int
    simulated: float
    elapsed: float
    tally: Tally
    messages: dict[str, int]
    folder: Path | None
    controlled: bool
    has_bar: bool
    interrupted: bool = False
    failure: str | None = None

    @property
    def real_time_factor(self) -> float:
        """Simulated time over elapsed time."""
        return self.simulated / self.elapsed if self.elapsed > 0 else 0.0


def run(
    bundle: Bundle,
    folder: Path | None,
    progress: Callable[[float], None] = lambda _: None,
    *,
    steps: int | None = None,
) -> RunResult:
    """Run a scenario in this process.

    Args:
        bundle: what to run, resolved.
        folder: where to record; None records nothing.
        progress: called now and then with the time simulated so far [s].
        steps: end after so many plant steps; None runs the scenario's duration.

    Raises:
        InputError: scenario and test-bed do not fit, or the folder exists.
        ConvergenceError: the bar cannot hang where the scenario starts.
    """
    with tempfile.TemporaryDirectory(prefix="cspm-") as place:
        bundle.write_files(Path(place))
        parts = assemble(bundle.scenario, bundle.testbed.testbed, Path(place), bundle.plant)
    scenario = bundle.scenario
    steps = steps or round(scenario.duration * scenario.rates.plant)
    if folder is None:
        return _simulate(parts, None, progress, steps)
    with RecordingWriter(
        folder, recorded_topics(parts), attachments=bundle.attachments(), metadata=metadata(bundle)
    ) as writer:
        return _simulate(parts, writer, progress, steps)


def recorded_topics(parts: Assembly) -> dict[str, Topic]:
    """Return the topics that this run publishes: measured ones only where a sensor is."""
    topics = parts.testbed.topics
    published = {"/clock", DIAGNOSTICS.name, *parts.sensors, *parts.references}
    if parts.controllers:
        published |= {"/wrench_command", "/tension_command", "/winches/torque_command"}
    elif parts.torque_generator:
        published.add("/winches/torque_command")
    return {
        name: topic
        for name, topic in topics.items()
        if name in published or name.startswith("/truth/")
    }


def metadata(bundle: Bundle) -> dict[str, str]:
    """Return the recording's metadata record."""
    return {
        "contract_version": CONTRACT_VERSION,
        "scenario": bundle.scenario.name,
        "seed": str(bundle.scenario.seed),
        "mode": MODE,
        "plant": bundle.plant,
        "package_version": version("cspm"),
        "testbed": bundle.testbed.testbed.name,
        "testbed_sha256": bundle.testbed.sha256,
    }


def _simulate(
    parts: Assembly,
    writer: RecordingWriter | None,
    progress: Callable[[float], None],
    steps: int,
) -> RunResult:
    scenario, plant = parts.scenario, parts.plant
    tally = Tally(steps, len(plant.tensions))
    publish: Mapping[str, Publish] = {}
    if writer is not None:
        names = [name for name in recorded_topics(parts) if name != DIAGNOSTICS.name]
        publish = {name: writer.channel(name).append for name in names}

    def publish_statuses(now_ns: int, statuses: list[Status]) -> None:
        if writer is not None:
            writer.append_payload(DIAGNOSTICS.name, now_ns, encode_diagnostics(now_ns, statuses))

    loop = Loop(parts, publish, publish_statuses)
    failure = None
    with _interruptible() as interrupted:
        began = time.perf_counter()
        try:
            # The first step of all compiles the kernels; it is no part of the speed.
            _advance(loop, parts, tally, 1)
            began = time.perf_counter()
            while plant.steps < steps and not interrupted():
                _advance(loop, parts, tally, min(PROGRESS_STEPS, steps - plant.steps))
                progress(plant.time)
        except DivergenceError as err:
            failure = f"{err}; {loop.history()}"
        elapsed = time.perf_counter() - began
        stopped = interrupted()
    if writer is not None:
        writer.close()
    return RunResult(
        scenario=scenario.name,
        seed=scenario.seed,
        simulated=plant.time,
        elapsed=elapsed,
        tally=tally,
        messages=writer.counts if writer is not None else {},
        folder=writer.folder if writer is not None else None,
        controlled=parts.controllers is not None,
        has_bar=parts.testbed.bar is not None,
        interrupted=stopped and failure is None,
        failure=failure,
    )


def _advance(loop: Loop, parts: Assembly, tally: Tally, steps: int) -> None:
    plant = parts.plant
    reference = parts.references.get("/bar/reference")
    zero = np.zeros(6)
    for _ in range(steps):
        bar_pose = plant.bar_state[:6].copy()
        tensions = plant.tensions.copy()
        loop.step()
        error = reference.values[:6] - bar_pose if reference else zero
        tally.add(error, tensions, loop.slack, loop.infeasible)


@contextmanager
def _interruptible() -> Iterator[Callable[[], bool]]:
    """Turn the first SIGINT or SIGTERM into a flag, so that a run ends between two steps."""
    seen: list[int] = []

    def note(number: int, _: FrameType | None) -> None:
        seen.append(number)
        # A second one means it: let it end the program the usual way.
        for each, handler in previous.items():
            signal.signal(each, handler)

    signals = (signal.SIGINT, signal.SIGTERM)
    previous = {each: signal.signal(each, note) for each in signals}
    try:
        yield lambda: bool(seen)
    finally:
        for each, handler in previous.items():
            signal.signal(each, handler)
