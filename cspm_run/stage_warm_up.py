"""What a run needs of compiled code, made or loaded before it counts."""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path

import numpy as np
from numba import config
from numpy.typing import NDArray

from cspm_control.phases.make import stage_phase
from cspm_control.stages.make import make_controller
from cspm_model.phase import Slots
from cspm_msgs_py.schedule import WAVE_TRAJECTORY, schedule_of
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.topics import POSE, WRENCH
from cspm_run.bundle import Bundle
from cspm_run.compiled.compiled_loop import first_compiled_step
from cspm_run.recorded_run import run
from cspm_sim.kernels.plant import plant_step

Array = NDArray[np.float64]


def rest_rows(node: str, bundle: Bundle) -> dict[str, Array]:
    """Return what a node reads where the bar hangs at rest, by topic."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    plan = schedule_of(scenario, testbed).nodes[node]
    position = np.array(scenario.bar_mean_pose[:3])
    rows = {}
    for name in (*plan.inputs, *plan.held):
        row = np.zeros(testbed.topics[name].width)
        if testbed.topics[name].fields[: len(POSE)] == POSE:
            row[:3], row[6] = position, 1.0
        elif testbed.topics[name].fields == WRENCH and testbed.bar:
            row[2] = -testbed.bar.mass * testbed.gravity
        rows[name] = row
    if "/winch_frame/pose" in rows:
        rows["/winch_frame/pose"][:3] = scenario.winch_frame.mean_pose[:3]
    return rows


def is_compiled() -> bool:
    """Return whether the plant of this version was compiled before.

    Importing kernels makes their folders; looking at effects compiles some of these.
    """
    return any(Path(config.CACHE_DIR).rglob(f"*.{plant_step.__name__}-*.nbi"))


def compile_beside(bundle: Bundle) -> None:
    """Let another process compile a run's controllers where nothing is compiled yet.

    Meanwhile this one compiles the plant, and finds the controllers in the cache when it comes to
    them, or compiles what is not there yet.
    """
    if not is_compiled():
        beside = multiprocessing.get_context("spawn").Process(
            target=compile_stages, args=([bundle],), name="compiling", daemon=True
        )
        beside.start()


def compile_apart(bundles: Sequence[Bundle], pool: ProcessPoolExecutor) -> list[Future[None]]:
    """Have two processes of a pool compile what runs need: the plant, and all controllers.

    Runs that begin together on an empty cache would each compile all of what they share.
    """
    return [pool.submit(_compile_run, bundles[0]), pool.submit(compile_stages, bundles)]


def _compile_run(bundle: Bundle) -> None:
    """Make a run's steps up to the first compiled ones; nothing of it remains."""
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    run(bundle, None, steps=first_compiled_step(schedule) + 1)


def compile_stages(bundles: Sequence[Bundle]) -> None:
    """Compile what the controllers of runs need; those that most depends on come first."""
    for bundle in bundles:
        scenario, testbed = bundle.scenario, bundle.testbed.testbed
        schedule = schedule_of(scenario, testbed)
        slots = Slots()
        slots.add({name: testbed.topics[name].width for name in schedule.topics})
        left_out = {WAVE_TRAJECTORY, *scenario.controllers}
        nodes = [node for node in schedule.nodes if node not in left_out]
        for node in sorted(nodes, reverse=True):
            # Without motions a governor plans nothing, which would take longer than compiling.
            stage = make_controller(node, scenario, testbed)
            stage.step(0, rest_rows(node, bundle), lambda _topic, _row: None)
            _compile_phase(stage, slots, schedule.period_ns)


def _compile_phase(stage: Stage, slots: Slots, period_ns: int) -> None:
    phase = stage_phase(stage, slots, period_ns)
    if phase is not None:
        # Looking it up compiles it.
        _ = phase.address
