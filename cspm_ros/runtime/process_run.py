"""A run with a process per node, in lockstep or in real time."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import overload

from cspm_control.safety import check_real_time
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.graph import RECORDER, members_of
from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.overview import overview
from cspm_msgs_py.ros.domain_claim import START, refuse_claimed
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_ros.processes.background import SHARE_BEHIND
from cspm_ros.processes.hosted_process import NodeHost
from cspm_ros.processes.node_processes import LEAVING_S, SILENCE_S, NodeProcesses
from cspm_ros.runtime.exit_watchdog import IN_ORDER
from cspm_ros.runtime.node_parameters import (
    LOCKSTEP,
    PROCESSES,
    REALTIME,
    NodeParameters,
    write_parameters,
)
from cspm_ros.runtime.progress_file import Report, read_report
from cspm_ros.runtime.stall_watchdog import PATIENCE_S, Patience, StartWatch
from cspm_run.bundle import SCENARIO, Bundle
from cspm_run.recorded_result import recorded_result
from cspm_run.run_result import RunResult

_LOOK_EVERY_S = 0.1
# How long a run in real time goes on after a node died, to record what the others do.
_AFTERMATH_S = 2.0
# A leader in real time that reports nothing for so long has been stopped.
_STUCK_S = 5.0


def run_processes(
    bundle: Bundle,
    folder: Path,
    progress: Callable[[float], None] = lambda _: None,
    *,
    mode: str = PROCESSES,
    external: bool = False,
    notify: Callable[[str], None] = lambda _: None,
    steps: int | None = None,
    domain_id: int | None = None,
    namespace: str = "/",
    patience_s: float = PATIENCE_S,
    own_nodes: Sequence[str] = (),
) -> RunResult:
    """Run a scenario with a process per node.

    Args:
        bundle: what to run, resolved.
        folder: where to record.
        progress: called now and then with the time simulated so far [s].
        mode: `processes`, in lockstep, or `realtime`.
        external: leave the plant out: hardware is in its place.
        notify: called with what the start waits for, in one line, when that changes, and with what
            the nodes warn of.
        steps: end after so many plant steps; None runs the scenario's duration.
        domain_id: instead of `ROS_DOMAIN_ID`.
        namespace: of all nodes, where this run meets no other.
        patience_s: give up when nothing moves for so long [s]; in real time it bounds the start
            alone, and not where somebody's drivers are waited for.
        own_nodes: controllers that are programs of the user's, by node name, in lockstep.

    Raises:
        InputError: scenario and test-bed do not fit, inputs that come in time would count as late,
            or another run has the domain.
        CspmError: a node ended before the run did, in real time before it began; or not all nodes
            joined.
    """
    if bundle.attached is not None:
        raise InputError("a concealed machine in processes, allowed: in one process")
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    schedule = schedule_of(scenario, testbed)
    names = members_of(schedule, external=external)
    # What is part of the plant is made with it.
    apart = {*own_nodes, *schedule.hosted}
    started = tuple(name for name in names if name not in apart)
    if mode == REALTIME:
        check_real_time(scenario.safety, schedule)
    # In lockstep the recorder has 48 steps of time; by the wall clock it would lose messages.
    behind = () if mode == REALTIME else (RECORDER,)
    refuse_claimed(domain_id, namespace.rstrip("/") + START)
    with ScratchFolder("run") as place:
        parameters = NodeParameters(
            plant=bundle.plant,
            pace=REALTIME if mode == REALTIME else LOCKSTEP,
            scenario=str(place / SCENARIO),
            nodes=names,
            own_nodes=tuple(own_nodes),
            steps=steps or round(scenario.duration * scenario.rates.plant),
            folder=str(folder.absolute()),
            mode=mode,
            report=str(place / "report.json"),
            patience=float(patience_s),
            until_stdin_closes=True,
        )
        for name, content in bundle.attachments().items():
            (place / name).write_bytes(content)
        write_parameters(place / "parameters.yaml", parameters)
        with (
            _environment(domain_id),
            interruptible() as stop_wanted,
            NodeProcesses(
                NodeHost(started, place / "parameters.yaml", place, namespace), place, behind
            ) as processes,
        ):
            leader = RECORDER if external else PLANT
            follower = _Follower(
                processes,
                leader,
                place / "report.json",
                mode == REALTIME,
                Patience(math.inf if external else patience_s),
            )
            try:
                report = follower.follow(progress, notify, stop_wanted)
            except CspmError as err:
                raise type(err)(with_remedy(str(err), folder)) from None
            interrupted = stop_wanted()
    return recorded_result(
        bundle,
        folder,
        mode,
        simulated=report.simulated,
        elapsed=report.elapsed,
        interrupted=interrupted,
        failure=with_remedy(report.failure or follower.failure, folder),
        timed=mode == REALTIME,
    )


@overload
def with_remedy(failure: str, folder: Path) -> str: ...
@overload
def with_remedy(failure: None, folder: Path) -> None: ...
@overload
def with_remedy(failure: str | None, folder: Path) -> str | None: ...
def with_remedy(failure: str | None, folder: Path) -> str | None:
    """Return why a run failed, and what restores a recording that was cut short by it."""
    if failure is None:
        return None
    try:
        complete = overview(folder).complete
    except InputError:
        # There is none, or nothing in it.
        return failure
    return failure if complete else f"{failure}; `cspm recover {folder}` restores its index"


class _Follower:
    """Follows a run to its end from outside.

    Attributes:
        failure: the node that ended before the run did, in real time, or that did not end.
    """

    def __init__(
        self,
        processes: NodeProcesses,
        leader: str,
        report: Path,
        realtime: bool,
        patience: Patience,
    ) -> None:
        self._processes, self._leader = processes, leader
        self._path, self._realtime, self._patience = report, realtime, patience
        self._stop_at: float | None = None
        self._leaving_s = LEAVING_S
        self._gone: dict[str, float] = {}
        self._last, self._moved = Report(), time.monotonic()
        self.failure: str | None = None

    def follow(
        self,
        progress: Callable[[float], None],
        notify: Callable[[str], None],
        stop_wanted: Callable[[], bool],
    ) -> Report:
        """Return the leader's last report, once the leader has ended.

        Raises:
            CspmError: not all nodes joined; or a node ended too early, after which in real time
                the others first show what they do.
        """
        processes, start = self._processes, StartWatch(notify, self._patience)
        while self._leader not in (ended := processes.ended()):
            report = read_report(self._path)
            if report.simulated:
                processes.begin()
            progress(report.simulated)
            self._pass_on(notify)
            self._look_for_dead(self._dead(ended, report))
            if not report.simulated:
                self._look_at_start(start, report.waiting)
            if stop_wanted() and self._stop_at is None:
                self._stop_at = time.monotonic()
            if self._stuck(report):
                return report
            if self._stop_at is not None and self._stop_at <= time.monotonic():
                processes.stop(self._leader)
            time.sleep(_LOOK_EVERY_S)
        report = read_report(self._path)
        self._see_off(report, stop_wanted())
        self._pass_on(notify)
        return report

    def _pass_on(self, notify: Callable[[str], None]) -> None:
        """Hand on what the nodes have warned of since the last call."""
        for warning in self._processes.warnings():
            notify(warning)

    @property
    def _longest_leaving_s(self) -> float:
        """How long all nodes may take to end; in lockstep the recorder gives way to others."""
        return self._leaving_s if self._realtime else self._leaving_s / SHARE_BEHIND

    def _see_off(self, report: Report, interrupted: bool) -> None:
        """Wait for the others to end as well, once the leader has."""
        processes = self._processes
        if report.finished or report.failure is not None or interrupted:
            if not processes.wait(self._longest_leaving_s):
                ended = processes.ended()
                stubborn = ", ".join(name for name in processes.by_name if name not in ended)
                self.failure = self.failure or f"{stubborn} did not end with the run"
        elif not self._realtime or not report.simulated:
            raise self._error(self._leader, processes.obituary(self._leader))
        else:
            processes.wait(_AFTERMATH_S)
            self._note_dead(self._leader, report)

    def _look_at_start(self, start: StartWatch, waiting: str) -> None:
        """Tell who has not joined; give the start up if that takes too long."""
        if self._path.exists():
            start.note_cost()
            start.look(waiting)
        else:
            start.look(f"waits for {self._leader}")
        if start.stuck is not None:
            raise CspmError(start.stuck)
        # Where processes start slowly they end slowly; but drivers come when somebody wants.
        if math.isfinite(self._patience.seconds):
            self._leaving_s = max(LEAVING_S, start.elapsed)

    def _stuck(self, report: Report) -> bool:
        """Return whether the leader neither goes on nor ends, as if it had been stopped."""
        now = time.monotonic()
        if report != self._last:
            self._last, self._moved = report, now
        overdue = self._stop_at is not None and now - self._stop_at > self._leaving_s
        silent = self._realtime and report.simulated > 0.0 and now - self._moved > _STUCK_S
        if (overdue or silent) and self.failure is None:
            length = now - self._moved
            text = f"{self._leader} gave no sign of life for {length:.0f} s"
            self.failure = f"{text}, at {report.simulated:.1f} s"
        return overdue or silent

    def _dead(self, ended: dict[str, int], report: Report) -> list[str]:
        """Return who ended too early: in order one may be ahead of the leader for a moment.

        Once the leader makes no further step it waits for what is still to be written, however
        long that takes, and nobody has to wait with it.
        """
        if report.ended:
            return [name for name, code in ended.items() if code not in IN_ORDER]
        now = time.monotonic()
        for name in ended:
            self._gone.setdefault(name, now)
        return [name for name, code in ended.items() if code or now - self._gone[name] > SILENCE_S]

    def _look_for_dead(self, dead: list[str]) -> None:
        if not dead or self.failure is not None:
            return
        obituary = self._processes.obituary(dead[0], self._longest_leaving_s)
        report = read_report(self._path)
        under_way = self._realtime and report.simulated
        if not under_way and not report.finished and report.failure is None:
            raise self._error(dead[0], obituary)
        if self._realtime:
            self._note_dead(dead[0], report)
            self._stop_at = time.monotonic() + _AFTERMATH_S

    def _error(self, name: str, obituary: str) -> CspmError:
        """Return the error of a node that ended before the run began; its exit code counts."""
        refused = self._processes.ended().get(name) == InputError.exit_code
        return InputError(obituary) if refused else CspmError(obituary)

    def _note_dead(self, name: str, report: Report) -> None:
        if self.failure is None:
            self.failure = f"{self._processes.obituary(name)}, at {report.simulated:.1f} s"


@contextmanager
def _environment(domain_id: int | None) -> Iterator[None]:
    """Put the domain into the environment that the nodes inherit."""
    before = os.environ.get("ROS_DOMAIN_ID")
    if domain_id is not None:
        os.environ["ROS_DOMAIN_ID"] = str(domain_id)
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("ROS_DOMAIN_ID", None)
        else:
            os.environ["ROS_DOMAIN_ID"] = before
