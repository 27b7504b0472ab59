"""A run of a machine that conceals something, under controllers that know its file alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

from bench.blind.reality.detection_limit import copied
from bench.blind.reality.reality import Reality
from bench.blind.reality.sensors import RealSensor
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.scenario import LockedWinches, load_scenario
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_run.assembly import Assembly, assemble, resolve
from cspm_run.bundle import Bundle, make_bundle
from cspm_run.library import find_scenario
from cspm_run.loop import Loop
from cspm_run.motions import motions_of
from cspm_run.recorded_run import INPROCESS, metadata, simulate
from cspm_sim.mujoco.influence import Scene
from cspm_sim.mujoco.plant import MujocoPlant
from cspm_sim.sensors import AnySensor

TRUTH = "/truth"
NOTES = "notes.txt"
_EVERY = 5  # a scene is kept per so many steps


def believed(scenario: str, duration: float, seed: int) -> Bundle:
    """Return the description of a run of the machine as it is believed to be.

    Raises:
        InputError: no such scenario.
    """
    path = find_scenario(scenario)
    loaded = load_scenario(path, [f"duration={duration}", f"seed={seed}"])
    file = load_testbed(path.parent / loaded.testbed)
    return make_bundle(resolve(loaded, file.testbed), file, path.parent)


@cache
def machine_of(scenario: str) -> Testbed:
    """Return the machine of a scenario as it is believed to be.

    Raises:
        InputError: no such scenario.
    """
    path = find_scenario(scenario)
    return load_testbed(path.parent / load_scenario(path).testbed).testbed


def assemble_concealed(bundle: Bundle, reality: Reality) -> Assembly:
    """Return the run's parts, plant and sensors being those of the machine as it is."""
    scenario = bundle.scenario
    with bundle.unpacked() as place:
        parts = assemble(scenario, bundle.testbed.testbed, place)
        motions = motions_of(scenario, bundle.testbed.testbed, place)
    plant = MujocoPlant(
        reality.testbed,
        motions["/winch_frame/reference"].at,
        parts.period_ns,
        bar_pose=parts.plant.bar_state[:6],
        locked=isinstance(scenario.control, LockedWinches),
        influences=reality.influences,
        drive=reality.drive,
    )
    believed_machine = bundle.testbed.testbed
    sensors: dict[str, AnySensor] = {
        name: RealSensor(
            believed_machine.topics[name],
            sensor,
            rate=getattr(scenario.rates, RATE_OF_SENSOR[name]),
            period_ns=parts.period_ns,
            seed=scenario.seed,
            quality=reality.quality,
            faults=reality.faults.get(name, ()),
            skew=reality.clocks.get(name, 0.0),
        )
        for name, sensor in believed_machine.sensors.items()
    }
    return replace(parts, plant=plant, sensors=sensors)


def record_concealed(
    bundle: Bundle,
    reality: Reality,
    folder: Path,
    *,
    note: str,
    without: tuple[str, ...],
    progress: Callable[[float], None],
) -> None:
    """Record what sensors and controllers say, nothing of the truth.

    Args:
        bundle: the run as it is believed to be.
        reality: the machine as it is.
        folder: a new one.
        note: the operator's.
        without: topics that are left out.
        progress: called with the time simulated so far [s].

    Raises:
        DivergenceError: the controllers lost the bar.
        KeyboardInterrupt: the run was ended early; what was recorded is not whole.
    """
    parts = assemble_concealed(bundle, reality)
    published = {
        name: timing
        for name, timing in parts.schedule.topics.items()
        if not name.startswith(TRUTH) and name not in without
    }
    parts = replace(parts, schedule=replace(parts.schedule, topics=published))
    topics = {
        name: topic
        for name, topic in bundle.testbed.testbed.topics.items()
        if name in published or name == DIAGNOSTICS.name
    }
    attachments = bundle.attachments() | {NOTES: note.encode()}
    scenario = bundle.scenario
    steps = round(scenario.duration * scenario.rates.plant)
    about = metadata(bundle, INPROCESS)
    with RecordingWriter(folder, topics, attachments=attachments, metadata=about) as writer:
        result = simulate(parts, writer, progress, steps)
    if result.interrupted:
        raise KeyboardInterrupt
    if result.failure:
        raise DivergenceError(result.failure)


def watch(bundle: Bundle, reality: Reality, until: float) -> list[Scene]:
    """Return scenes of an unrecorded run up to a time [s]."""
    parts = assemble_concealed(bundle, reality)
    loop = Loop(parts, {}, lambda now, status: None)
    plant = parts.plant
    assert isinstance(plant, MujocoPlant)
    scenes = []
    while plant.time < until:
        if plant.steps % _EVERY == 0:
            scenes.append(copied(plant.scene(plant.time)))
        loop.step()
    return scenes
