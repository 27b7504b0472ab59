"""What one node does in a process of its own."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from rcl_interfaces.msg import ParameterDescriptor

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.graph import NODES, PLAYER, RECORDER, VIEWER
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.ros.session import FAREWELL_S, Session
from cspm_msgs_py.schedule import PLANT, Schedule, schedule_of
from cspm_ros.inject.injection import PROCESS, process_name
from cspm_ros.processes.foreground import put_ahead
from cspm_ros.replay.replay_run import run_player
from cspm_ros.runtime.exit_watchdog import exit_watchdog
from cspm_ros.runtime.lockstep_nodes import LockstepRun
from cspm_ros.runtime.node_parameters import REALTIME, NodeParameters, read_parameters
from cspm_ros.runtime.progress_file import Report
from cspm_ros.runtime.realtime_nodes import RealtimeRun
from cspm_ros.runtime.stall_watchdog import LOOK_EVERY_S, Patience, Waiting, Watch
from cspm_ros.scene.viewer_node import ViewerNode
from cspm_run.recorded_run import new_recording

# Where nobody is in a hurry: longer than lost packets take; or as long as starting took.
_DELIVERY_S = 3.0
_STDIN_BYTES = 4096
# To destroy what the node has takes a tenth of a second; or as long as starting took, where the
# processor is full.
_LEAVING_S = 3.0


def run_node(
    name: str, args: Sequence[str], began: float, failed: Callable[[CspmError], None]
) -> Path | None:
    """Run a node until its run ends or a signal comes.

    Return the recording of a recorder that nobody follows from outside, as `cspm run` does.

    Args:
        name: one of `NODES`.
        args: command line, ROS style: `--ros-args -p scenario:=calm`.
        began: when the program did, on `time.perf_counter` [s].
        failed: called with a failure before the node leaves the graph, which may never end.

    Raises:
        InputError: no such node, or parameters that cannot be used.
        CspmError: not all nodes joined, the run stood still, or the plant diverged.
    """
    if name not in NODES:
        raise InputError(f"node {name}: allowed: {', '.join(NODES)}")
    with ExitStack() as stack:
        begin_to_leave = stack.enter_context(exit_watchdog())
        session = stack.enter_context(Session(args))
        leaving_s = max(_LEAVING_S, time.perf_counter() - began)

        def leave(_: type[BaseException] | None, err: BaseException | None, __: object) -> None:
            if isinstance(err, CspmError):
                failed(err)
            begin_to_leave(leaving_s, err is not None)

        stack.push(leave)
        node = session.node(name)
        parameters = read_parameters(node.node)
        described = ParameterDescriptor(description="host and number of its process")
        described.read_only = True
        node.node.declare_parameter(PROCESS, process_name(), described, ignore_override=True)
        if parameters.until_stdin_closes:
            _stop_when_stdin_closes(session)
        if name == PLAYER:
            run_player(session, node, parameters, began)
        elif name == VIEWER:
            ViewerNode(node, parameters.bundle().testbed.testbed)
            session.spin_until(lambda: session.stopped)
        elif parameters.pace == REALTIME:
            session.poll()
            _run_realtime(session, node, parameters, stack)
        else:
            _run_lockstep(session, node, parameters, stack, began)
    followed = parameters.until_stdin_closes
    return parameters.recording_folder if name == RECORDER and not followed else None


def _watch(part: Waiting, node: ContractNode, parameters: NodeParameters, began: float) -> Watch:
    patience = Patience(parameters.patience, time.perf_counter() - began)
    # Who holds standard input open sees all nodes of the run, and ends them if one does not join.
    return Watch([part], patience, node.warn, guarded=parameters.until_stdin_closes)


def _run_lockstep(
    session: Session,
    node: ContractNode,
    parameters: NodeParameters,
    stack: ExitStack,
    began: float,
) -> None:
    bundle = parameters.bundle()
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    run = LockstepRun(bundle, parameters.members(schedule), parameters.own_of(schedule))
    if node.name == PLANT:
        _run_plant(session, node, parameters, run, began)
        return
    if node.name == RECORDER:
        folder = parameters.recording_folder
        writer = stack.enter_context(
            new_recording(bundle, folder, parameters.recorded_mode, run.own)
        )
        recorder = run.recorder(node, writer)
        stack.callback(recorder.close)
        _spin(session, _watch(recorder, node, parameters, began), lambda: recorder.ended)
        return
    _check_part(node, bundle.scenario.name, schedule)
    stage = run.stage(node)
    _spin(session, _watch(stage, node, parameters, began), lambda: stage.ended)


def _run_realtime(
    session: Session, node: ContractNode, parameters: NodeParameters, stack: ExitStack
) -> None:
    bundle = parameters.bundle()
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    run = RealtimeRun(bundle, parameters.members(schedule))
    steps = parameters.steps or round(bundle.scenario.duration * bundle.scenario.rates.plant)
    path = Path(parameters.report) if parameters.report else None
    if node.name == PLANT:
        link = run.link()
        plant = run.plant(node, steps, link)
        for name in run.hosted:
            run.stage(session.node(name), link=link)
        _go_ahead(node, parameters)
        if parameters.start_on_call:
            plant.leader.wait_for_call()
        session.every(
            LOOK_EVERY_S,
            lambda: _report(path, plant.leader, plant.waiting(), plant.failure),
        )
        session.spin_until(lambda: plant.ended or session.stopped)
        plant.leader.end()
        _report(path, plant.leader, "", plant.failure)
        # Nobody hears of the end from a node that has left.
        session.deliver(FAREWELL_S)
        if plant.failure is not None:
            raise CspmError(plant.failure)
    elif node.name == RECORDER:
        folder = parameters.recording_folder
        writer = stack.enter_context(run.new_recording(folder, parameters.recorded_mode))
        recorder, leader = run.recorder(node, writer, steps, parameters.patience)
        _go_ahead(node, parameters)
        stack.callback(recorder.close)
        if leader is not None and parameters.start_on_call:
            leader.wait_for_call()
        if leader is not None:
            session.every(
                LOOK_EVERY_S,
                lambda: _report(path, leader, leader.waits(), None),
            )
        session.spin_until(lambda: recorder.ended or session.stopped)
        if leader is not None:
            leader.end()
            _report(path, leader, "", None)
            session.deliver(FAREWELL_S)
    else:
        _check_part(node, bundle.scenario.name, schedule)
        stage = run.stage(node, parameters.goal_duration, parameters.goal_sender)
        _go_ahead(node, parameters)
        session.spin_until(lambda: stage.ended or session.stopped)


def _go_ahead(node: ContractNode, parameters: NodeParameters) -> None:
    """Take the priority that was asked for, once all is compiled: that has time."""
    if parameters.priority and (refused := put_ahead(parameters.priority)):
        node.warn(f"priority {parameters.priority}: not permitted: {refused}")


def _check_part(node: ContractNode, scenario: str, schedule: Schedule) -> None:
    if node.name in schedule.hosted:
        raise InputError(
            f"node {node.name}: scenario {scenario} has it in its drives (drive: tension), allowed:"
            f" {', '.join((PLANT, *(n for n in schedule.nodes if n != node.name), RECORDER))}"
        )
    if node.name not in schedule.nodes:
        raise InputError(
            f"node {node.name}: scenario {scenario} has none, allowed:"
            f" {', '.join((PLANT, *schedule.nodes, RECORDER))}"
        )


def _report(path: Path | None, leader: Leader, waiting: str, failure: str | None) -> None:
    if path is not None:
        elapsed, ended = leader.elapsed, leader.end_ns is not None
        Report(elapsed, elapsed, waiting, failure, ended, ended).write(path)


def _spin(session: Session, watch: Watch, ended: Callable[[], bool]) -> None:
    session.every(LOOK_EVERY_S, watch.look)
    session.spin_until(lambda: ended() or session.stopped or watch.stuck is not None)
    if watch.stuck is not None:
        raise CspmError(watch.stuck)
    if ended():
        session.deliver(FAREWELL_S if session.stopped else max(_DELIVERY_S, watch.cost))


def _run_plant(
    session: Session,
    node: ContractNode,
    parameters: NodeParameters,
    run: LockstepRun,
    began: float,
) -> None:
    scenario = run.bundle.scenario
    link = run.link()
    steps = parameters.steps or round(scenario.duration * scenario.rates.plant)
    plant = run.plant(node, steps, link)
    for name in run.hosted:
        run.stage(session.node(name), link)
    watch = _watch(plant, node, parameters, began)
    path = Path(parameters.report) if parameters.report else None

    def report() -> None:
        if path is not None:
            waiting = "" if plant.finished else plant.waiting()
            times = (plant.simulated, watch.elapsed)
            Report(*times, waiting, plant.failure, plant.ended, plant.finished).write(path)

    def look() -> None:
        watch.look()
        if session.stopped:
            plant.stop()
        report()

    session.every(LOOK_EVERY_S, look)
    session.spin_until(
        lambda: plant.finished or session.stopped or watch.stuck is not None,
    )
    if session.stopped:
        plant.stop()
        session.spin_until(lambda: plant.finished, FAREWELL_S)
    report()
    if plant.finished and not session.stopped:
        session.deliver(max(_DELIVERY_S, watch.cost))
    if watch.stuck is not None or plant.failure is not None:
        raise CspmError(watch.stuck or plant.failure or "")


def _stop_when_stdin_closes(session: Session) -> None:
    def wait() -> None:
        # Not through `sys.stdin`: a thread that waits there holds a lock that Python's end wants.
        while os.read(sys.stdin.fileno(), _STDIN_BYTES):
            pass
        session.stop()

    threading.Thread(target=wait, name="stdin", daemon=True).start()
