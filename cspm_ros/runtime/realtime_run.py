"""A run in real time with all nodes in one process, over real ROS 2 topics.

Between nodes of one process the middleware hands messages over as they are sent, so that none is
lost however late a node is. With a process per node each message wakes a thread of each reader's,
which two cores cannot do at 1 kHz.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.graph import RECORDER, members_of
from cspm_msgs_py.ros.session import FAREWELL_S, Session
from cspm_msgs_py.schedule import schedule_of
from cspm_ros.runtime.node_main import ROS_ARGS
from cspm_ros.runtime.realtime_nodes import RealtimeRun
from cspm_ros.runtime.stall_watchdog import LOOK_EVERY_S, PATIENCE_S, Patience, StartWatch
from cspm_run.bundle import Bundle
from cspm_run.recorded_result import recorded_result
from cspm_run.run_result import RunResult

REALTIME = "realtime"


def run_realtime(
    bundle: Bundle,
    folder: Path,
    progress: Callable[[float], None] = lambda _: None,
    *,
    external: bool = False,
    notify: Callable[[str], None] = lambda _: None,
    steps: int | None = None,
    domain_id: int | None = None,
    namespace: str = "/",
    patience_s: float = PATIENCE_S,
) -> RunResult:
    """Run a scenario by the wall clock, as ROS 2 nodes in this process.

    Args:
        bundle: what to run, resolved.
        folder: where to record.
        progress: called now and then with the time run so far [s].
        external: leave the plant out: hardware is in its place.
        notify: called with what the start waits for, in one line, when that changes.
        steps: end after so many plant steps; None runs the scenario's duration.
        domain_id: instead of `ROS_DOMAIN_ID`.
        namespace: of all nodes, where this run meets no other.
        patience_s: bounds the start [s], as in lockstep, but not where somebody's drivers are
            waited for.

    Raises:
        InputError: scenario and test-bed do not fit, the folder exists, or inputs that come in
            time would count as late.
        ConvergenceError: the bar cannot hang where the scenario starts.
        CspmError: the nodes did not find each other.
    """
    began = time.perf_counter()
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    run = RealtimeRun(bundle, members_of(schedule_of(scenario, testbed), external=external))
    steps = steps or round(scenario.duration * scenario.rates.plant)
    with ExitStack() as stack:
        args = [ROS_ARGS, "-r", f"__ns:={namespace}"]
        session = stack.enter_context(Session(args, domain_id=domain_id, polled=True))
        leads = session.node(run.leader)
        # Before any other node is there, which another run's could hear.
        run.claim(leads)
        link = run.link()
        plant = None if external else run.plant(leads, steps, link)
        for name in run.stages:
            run.stage(session.node(name), link=link if name in run.hosted else None)
        writer = stack.enter_context(run.new_recording(folder, REALTIME))
        recorder, leading = run.recorder(
            leads if external else session.node(RECORDER), writer, steps, patience_s
        )
        stack.callback(recorder.close)
        leader = leading if plant is None else plant.leader
        assert leader is not None
        patience = Patience(math.inf if external else patience_s, time.perf_counter() - began)
        start = StartWatch(notify, patience)

        def look() -> None:
            if not leader.elapsed:
                start.look(leader.waits())
            progress(leader.elapsed)

        session.every(LOOK_EVERY_S, look)
        session.spin_until(
            lambda: leader.end_ns is not None or session.stopped or start.stuck is not None
        )
        if start.stuck is not None:
            raise CspmError(start.stuck)
        leader.end()
        # Nobody hears of the end from nodes that have left.
        session.deliver(FAREWELL_S)
    return recorded_result(
        bundle,
        folder,
        REALTIME,
        simulated=leader.elapsed,
        elapsed=leader.elapsed,
        interrupted=session.stopped,
        failure=plant.failure if plant is not None else None,
        timed=True,
    )
