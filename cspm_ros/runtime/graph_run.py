"""A run with all nodes in one process, over real ROS 2 topics, in lockstep."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_ros.runtime.lockstep_nodes import LockstepRun
from cspm_ros.runtime.stall_watchdog import LOOK_EVERY_S, PATIENCE_S, Patience, Watch
from cspm_run.bundle import Bundle
from cspm_run.recorded_result import recorded_result
from cspm_run.recorded_run import new_recording
from cspm_run.run_result import RunResult

GRAPH = "graph"


def run_graph(
    bundle: Bundle,
    folder: Path,
    progress: Callable[[float], None] = lambda _: None,
    *,
    steps: int | None = None,
    domain_id: int | None = None,
    patience_s: float = PATIENCE_S,
) -> RunResult:
    """Run a scenario as ROS 2 nodes in this process.

    Args:
        bundle: what to run, resolved.
        folder: where to record.
        progress: called now and then with the time simulated so far [s].
        steps: end after so many plant steps; None runs the scenario's duration.
        domain_id: instead of `ROS_DOMAIN_ID`.
        patience_s: give up when nothing moves for so long [s], once the run is under way.

    Raises:
        InputError: scenario and test-bed do not fit, or the folder exists.
        ConvergenceError: the bar cannot hang where the scenario starts.
        CspmError: nothing moved for `patience_s`, or for longer while it started.
    """
    began = time.perf_counter()
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    schedule = schedule_of(scenario, testbed)
    run = LockstepRun(bundle, (PLANT, *schedule.nodes, RECORDER))
    steps = steps or round(scenario.duration * scenario.rates.plant)
    with ExitStack() as stack:
        session = stack.enter_context(Session(domain_id=domain_id, polled=True))
        link = run.link()
        plant = run.plant(session.node(PLANT), steps, link)
        others = [run.stage(session.node(name), link) for name in schedule.nodes]
        writer = stack.enter_context(new_recording(bundle, folder, GRAPH))
        recorder = run.recorder(session.node(RECORDER), writer)
        stack.callback(recorder.close)
        patience = Patience(patience_s, time.perf_counter() - began)
        watch = Watch([plant, *others, recorder], patience, session.warn)

        def look() -> None:
            if session.stopped:
                plant.stop()
            watch.look()
            progress(max(0, plant.progress) * schedule.period_ns * 1e-9)

        session.every(LOOK_EVERY_S, look)
        session.spin_until(lambda: plant.finished or watch.stuck is not None)
        if watch.stuck is not None:
            raise CspmError(watch.stuck)
    return recorded_result(
        bundle,
        folder,
        GRAPH,
        simulated=plant.simulated,
        elapsed=watch.elapsed,
        interrupted=session.stopped,
        failure=plant.failure,
    )
