"""A controller's node in real time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import ControllerError
from cspm_msgs_py.graph import Edges
from cspm_msgs_py.ros.bound_flag import BoundFlag
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.fault_line import FaultLine
from cspm_msgs_py.ros.graph_publishers import bind
from cspm_msgs_py.ros.guard_ports import GuardPorts
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import CLOCK, FORCE_CONTROLLER, TORQUE_COMMAND, Schedule
from cspm_msgs_py.stepping.plausibility import Plausibility
from cspm_msgs_py.stepping.proof import Proof
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory
from cspm_msgs_py.stepping.stage import Guard, Stage
from cspm_msgs_py.topics import DIAGNOSTICS, SAFE, Topic

Array = NDArray[np.float64]
# While processes find each other they stand still for some tenths of a second.
_STEADY_NS = 500_000_000


class RealtimeNode:
    """Feeds a stage with the latest messages, at its own rate."""

    def __init__(
        self,
        node: ContractNode,
        stage: Stage,
        guard: Guard | None,
        schedule: Schedule,
        topics: Mapping[str, Topic],
        edges: Mapping[str, Edges],
        stale_after: float,
        *,
        plausibility: Plausibility | None = None,
        lateness_ns: int | None = None,
        on_start: Callable[[int], None] | None = None,
        on_safe: Callable[[bool], None] | None = None,
        proof: Proof | None = None,
    ) -> None:
        """Connect the stage; `guard` is the same stage where it has a safe state.

        Args:
            node: the ROS node, named as the stage.
            stage: the controller.
            guard: the stage itself where it commands winches.
            schedule: of the scenario, for rates and delays.
            topics: of the test-bed, by name.
            edges: who reads what in this run.
            stale_after: age beyond its due at which an input is too old [s].
            plausibility: says which inputs cannot be true.
            lateness_ns: of a guard, how old the state may be that it answers [ns]; None: any age.
            on_start: called with the first instant [ns] of the run.
            on_safe: called with whether the winches are in their safe state.
            proof: what drivers have to show before the run; None: they are our own.
        """
        plan = schedule.nodes[stage.node]
        self._node, self._guard = node, guard
        self._on_start, self._on_safe = on_start, on_safe
        self._proof, self._steadily = proof, False
        node.keep_time()
        read = [name for name in (*plan.inputs, *plan.held) if name != CLOCK]
        self._foreign = [name for name in read if not edges[name].senders]
        # Drivers in the plant's place read the commands as well.
        self._driven = [name for name in plan.outputs if name == TORQUE_COMMAND and self._foreign]
        self._line = FaultLine(node, None if guard is None else self._hear_of_fault)
        self._bindings = {name: bind(node, topics[name], edges) for name in read}
        publish = {name: node.publisher(topics[name], edges[name].readers) for name in plan.outputs}
        self._publish = publish
        self._loop = SampleAndHold(
            stage,
            schedule,
            stale_after,
            publish,
            node.status_publisher(edges[DIAGNOSTICS.name].readers),
            guard,
            bindings=self._bindings,
            plausibility=plausibility,
            lateness_ns=lateness_ns,
            on_fault=self._line.report,
        )
        self._subscribe([topics[name] for name in read])
        self._connect_guard(FORCE_CONTROLLER in schedule.nodes)
        self._unsteady_ns = node.now_ns()
        self._leader = FollowerSide(
            node,
            schedule.period_ns,
            on_start=self._start,
            ready=self._connected,
            proving=lambda: self._steadily and proof is not None and not proof.passed,
        )
        node.every(plan.divider * schedule.period_ns * 1e-9, self._tick)

    def _subscribe(self, topics: Iterable[Topic]) -> None:
        """Hear the stage's inputs."""
        for topic in topics:
            receive = partial(self._receive, topic.name)
            self._node.subscribe_tagged_rows(topic, receive, partial(self._refuse, topic.name))

    def _connect_guard(self, guarded: bool) -> None:
        """Offer the guard's ports, or hear of the safe state where another node is `guarded`."""
        node, guard = self._node, self._guard
        if guard is not None:
            GuardPorts(node, guard, node.now_ns, self._reset, lambda: self._loop.begun)
        elif guarded:
            BoundFlag(node, SAFE, FORCE_CONTROLLER, self._note_safe, self._refuse)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._leader.end_ns is not None

    def _receive(self, topic: str, stamp_ns: int, row: Array, gid: bytes | None) -> None:
        self._loop.receive(topic, stamp_ns, row, self._node.now_ns(), gid)

    def _refuse(self, topic: str, reason: str) -> None:
        binding = self._bindings.get(topic)
        if not self._loop.begun and binding is not None and binding.bound is None:
            # Before the run nobody is bound, and who is missing is reported by its leader.
            return
        self._loop.refuse(self._node.now_ns(), reason)
        self._node.complain(topic, reason)

    def _hear_of_fault(self, reason: str) -> None:
        self._loop.alarm(self._node.now_ns(), reason)

    def _note_safe(self, safe: bool) -> None:
        if self._foreign and safe and not self._loop.safe:
            # Drivers stamp by the clock as it is; a simulated plant goes on by the old one.
            self._node.accept_clock()
        self._loop.note_safe(safe)
        if self._on_safe is not None:
            self._on_safe(safe)

    def _reset(self, now_ns: int) -> str | None:
        return self._loop.reset(now_ns)

    def _start(self, start_ns: int) -> None:
        if self._on_start is not None:
            self._on_start(start_ns)
        self._loop.start(start_ns)

    def _connected(self) -> bool:
        """Return whether all inputs are bound and drivers have been heard without a pause.

        And whether they read the commands to them, and have proved what they are to prove.
        """
        if self._loop.begun:
            return True
        self._steadily = self._steady()
        return self._steadily and (self._proof is None or self._proof.passed)

    def _steady(self) -> bool:
        if any([binding.missing() for binding in self._bindings.values()]):
            return False
        now = self._node.now_ns()
        read = all(self._node.has_other_readers(name) for name in self._driven)
        if not read or not self._loop.hears(self._foreign, now):
            self._unsteady_ns = now
        return not self._foreign or now - self._unsteady_ns >= _STEADY_NS

    def _tick(self) -> None:
        fault = self._node.clock_fault()
        if fault is not None:
            self._loop.alarm(self._node.now_ns(), fault)
            if self._foreign and self._loop.safe:
                self._node.accept_clock()
        if self._proof is not None:
            self._prove(self._proof)
        self._loop.tick(self._node.now_ns())

    def _prove(self, proof: Proof) -> None:
        """Have drivers prove what they are, then hold the machine until the stage computes."""
        if self._loop.computed or self._loop.safe:
            self._proof = None
            proof.close()
        elif not self._steadily or not (proof.under_way or self._leader.asked()):
            proof.restart()
        elif (command := proof.torque(self._node.now_ns())) is not None:
            stamp_ns, torque = command
            self._publish[TORQUE_COMMAND](stamp_ns, stamp_ns, torque)


class RealtimeWaveNode:
    """Sends the references by the wall."""

    def __init__(
        self,
        node: ContractNode,
        stage: Stage,
        schedule: Schedule,
        topics: Mapping[str, Topic],
        edges: Mapping[str, Edges],
    ) -> None:
        """Connect the wave trajectory; arguments as `RealtimeNode`."""
        plan = schedule.nodes[stage.node]
        self._node = node
        node.keep_time()
        self._line = FaultLine(node)
        publish = {name: node.publisher(topics[name], edges[name].readers) for name in plan.outputs}
        status = node.status_publisher(edges[DIAGNOSTICS.name].readers)
        self._loop = WallTrajectory(stage, schedule, publish, status)
        self._leader = FollowerSide(node, schedule.period_ns, on_start=self._loop.start)
        # Twice as often as references are due: a timer that is late skips calls.
        node.every(0.5e-9 * plan.divider * schedule.period_ns, self._tick)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._leader.end_ns is not None

    def _tick(self) -> None:
        fault = self._node.clock_fault()
        if fault is not None:
            self._line.report(fault)
        try:
            self._loop.tick(self._node.now_ns())
        except ControllerError as err:
            self._line.report(str(err))
