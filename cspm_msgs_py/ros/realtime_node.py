"""A controller's node in real time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import ControllerError, InputError
from cspm_msgs_py.graph import RECORDER, Edges
from cspm_msgs_py.ros.bound_flag import BoundFlag
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.fault_line import FaultLine
from cspm_msgs_py.ros.graph_publishers import bind
from cspm_msgs_py.ros.guard_ports import GuardPorts
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.ros.stage_node import Publish, commanding
from cspm_msgs_py.schedule import (
    CLOCK,
    FORCE_CONTROLLER,
    PLANT,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    Schedule,
)
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.stepping.plausibility import Plausibility
from cspm_msgs_py.stepping.proof import Proof
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory
from cspm_msgs_py.stepping.stage import Guard, Stage
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS, EMERGENCY_STOP, QOS_DEPTH, SAFE, Topic

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
        link: DriveLink | None = None,
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
            link: to the plant that the stage is part of; None: it is a node of its own.
        """
        plan = schedule.nodes[stage.node]
        self._node, self._guard = node, guard
        self._on_start, self._on_safe = on_start, on_safe
        self._proof, self._steadily = proof, False
        self._set_brake: Callable[[], None] = lambda: None
        node.keep_time()
        read = [name for name in (*plan.inputs, *plan.held) if name != CLOCK]
        self._now_ns = node.now_ns if link is None else link.now_ns
        if link is not None:
            read = [name for name in read if edges[name].senders != (PLANT,)]
        self._foreign = [name for name in read if not edges[name].senders]
        # Drivers in the plant's place read the commands as well.
        self._driven = _to_drivers(plan.outputs, edges) if self._foreign else []
        hears = guard is not None or bool(self._driven)
        self._line = FaultLine(node, self._hear_of_fault if hears else None)
        self._bindings = {name: bind(node, topics[name], edges) for name in read}
        publish = {name: node.publisher(topics[name], edges[name].readers) for name in plan.outputs}
        if link is not None:
            publish[TORQUE_COMMAND] = commanding(publish[TORQUE_COMMAND], link)
        self._publish = publish
        self._silent = ""
        for name in self._driven:
            publish[name] = self._unless_silent(publish[name])
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
            on_fault=self._report,
        )
        self._subscribe([topics[name] for name in read])
        self._connect_guard(FORCE_CONTROLLER in schedule.nodes)
        self._unsteady_ns = self._now_ns()
        self._leader = FollowerSide(
            node,
            schedule.period_ns,
            on_start=self._start,
            ready=self._connected,
            proving=lambda: self._steadily and proof is not None and not proof.passed,
        )
        if link is None:
            node.every(plan.divider * schedule.period_ns * 1e-9, self._tick)
        else:
            self._join(link)

    def _join(self, link: DriveLink) -> None:
        """Compute on what the plant hands on, in its time, and set its brakes."""

        def receive(topic: str, stamp_ns: int, row: Array) -> None:
            try:
                self._receive(topic, stamp_ns, row, None)
            except InputError as err:
                self._refuse(topic, str(err))

        def tick() -> None:
            self._tick()
            if self._guard is not None:
                link.brake(self._guard.brake)

        link.receive, link.tick = receive, tick

    def _subscribe(self, topics: Iterable[Topic]) -> None:
        """Hear the stage's inputs."""
        for topic in topics:
            receive = partial(self._receive, topic.name)
            self._node.subscribe_tagged_rows(topic, receive, partial(self._refuse, topic.name))

    def _connect_guard(self, guarded: bool) -> None:
        """Offer the guard's ports, or hear of the safe state where another node is `guarded`."""
        node, guard = self._node, self._guard
        if guard is None and self._driven:
            kind = ros_class(BRAKE.ros_type)
            brake = node.node.create_publisher(kind, local(BRAKE.name), contract_qos())
            self._set_brake = lambda: brake.publish(kind(data=True))
            self._node.subscribe_objects(
                EMERGENCY_STOP.name, ros_class(EMERGENCY_STOP.ros_type), self._stop, QOS_DEPTH
            )
        if guard is not None:
            ports = GuardPorts(node, guard, self._now_ns, self._reset, lambda: self._loop.begun)
            self._set_brake = ports.set_brake
        elif guarded:
            BoundFlag(node, SAFE, FORCE_CONTROLLER, self._note_safe, self._refuse)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._leader.end_ns is not None

    def _receive(self, topic: str, stamp_ns: int, row: Array, gid: bytes | None) -> None:
        self._loop.receive(topic, stamp_ns, row, self._now_ns(), gid)

    def _refuse(self, topic: str, reason: str) -> None:
        binding = self._bindings.get(topic)
        if not self._loop.begun and binding is not None and binding.bound is None:
            # Before the run nobody is bound, and who is missing is reported by its leader.
            return
        self._loop.refuse(self._now_ns(), reason)
        self._node.complain(topic, reason)

    def _hear_of_fault(self, reason: str) -> None:
        if self._guard is not None:
            self._loop.alarm(self._now_ns(), reason)
        elif self._loop.begun:
            self._fall_silent(reason)

    def _report(self, reason: str) -> None:
        """Have the guard go to its safe state; where that is a drive, by silence."""
        self._line.report(reason)
        if self._driven and self._guard is None:
            self._fall_silent(reason)

    def _fall_silent(self, reason: str) -> None:
        if not self._silent:
            self._silent = reason
            self._node.warn(f"{self._driven[0]}: silent from now on, so that drives hold: {reason}")

    def _unless_silent(self, publish: Publish) -> Publish:
        """Return what publishes commands to drivers with stamps that go on, until it is silent."""
        last_ns = -1

        def send(log_ns: int, stamp_ns: int, row: Array) -> None:
            nonlocal last_ns
            if not self._silent:
                last_ns = max(stamp_ns, last_ns + 1)
                publish(log_ns, last_ns, row)

        return send

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
        now = self._now_ns()
        read = all(self._node.has_other_readers(name) for name in self._driven)
        if not read or not self._loop.hears(self._foreign, now):
            self._unsteady_ns = now
        return not self._foreign or now - self._unsteady_ns >= _STEADY_NS

    def _tick(self) -> None:
        fault = self._node.clock_fault()
        if fault is not None:
            self._loop.alarm(self._now_ns(), fault)
            if self._foreign and self._loop.safe:
                self._node.accept_clock()
        if self._proof is not None:
            self._prove(self._proof)
        self._loop.tick(self._now_ns())

    def _prove(self, proof: Proof) -> None:
        """Have drivers prove what they are, then hold the machine until the stage computes."""
        if self._loop.computed or self._loop.safe:
            self._proof = None
            proof.close()
        elif not self._steadily or not (proof.under_way or self._leader.asked()):
            proof.restart()
        else:
            self._command(proof)

    def _command(self, proof: Proof) -> None:
        try:
            command = proof.command(self._now_ns())
        except InputError:
            # The drives miss the commands only once their watchdogs have waited.
            self._set_brake()
            raise
        if command is not None:
            stamp_ns, row = command
            self._publish[self._driven[0]](stamp_ns, stamp_ns, row)

    def _stop(self, message: object) -> None:
        if message.data:  # type: ignore[attr-defined]
            self._fall_silent("emergency stop set")


def _to_drivers(outputs: Iterable[str], edges: Mapping[str, Edges]) -> list[str]:
    """Return the commands that no node of the run obeys, but drivers do."""
    commands = [name for name in outputs if name in (TENSION_COMMAND, TORQUE_COMMAND)]
    return [name for name in commands if not set(edges[name].readers) - {RECORDER}]


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
