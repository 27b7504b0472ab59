"""The simulated plant's node in real time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import Edges
from cspm_msgs_py.ros.bound_flag import BoundFlag
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.fault_line import FaultLine
from cspm_msgs_py.ros.graph_publishers import bind, census_of
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.schedule import CLOCK, FORCE_CONTROLLER, PLANT, TORQUE_COMMAND, Schedule
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS, SAFE, Topic
from cspm_sim.plant_run import PlantRun
from cspm_sim.realtime_plant import RealtimePlant
from cspm_sim.simulator import Publish
from cspm_sim.watchdog import Watchdog

Array = NDArray[np.float64]
RESET = "~/reset"


class RealtimePlantNode:
    """Steps the plant by the wall; it leads the run."""

    def __init__(
        self,
        node: ContractNode,
        run: PlantRun,
        watchdog: Watchdog,
        lateness_ns: int | None = None,
    ) -> None:
        """Connect the plant to the ROS node; its watchdog releases or holds it.

        `lateness_ns` is how old the state may be that a command answers [ns]; None: any age.
        """
        topics, edges, schedule = run.topics, run.edges, run.schedule
        self._node, self._watchdog = node, watchdog
        node.keep_time()
        self._line = FaultLine(node)
        self._start_ns = 0
        self._simulator = run.simulator(
            {
                name: self._on_wall_clock(node, topics[name], edge)
                for name, edge in run.published.items()
                if name != CLOCK
            },
            lambda: self._start_ns,
        )
        status = node.status_publisher(edges[DIAGNOSTICS.name].readers)
        link = run.link
        # What the drives command themselves is nobody else's.
        self._binding = None if link else bind(node, topics[TORQUE_COMMAND], edges)
        self._plant = RealtimePlant(
            self._simulator,
            schedule,
            run.steps,
            watchdog,
            status,
            binding=self._binding,
            lateness_ns=lateness_ns,
            on_fault=self._line.report,
            link=link,
        )
        self.leader = Leader(
            node,
            schedule.period_ns,
            run.others,
            # One period more, in which the last step is made.
            (run.steps + 1) * schedule.period_ns,
            missing=census_of(node, run.sent, edges),
            on_start=self._start,
        )
        if link is not None:
            self._join(link)
        else:
            self._subscribe(topics, schedule)
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), RESET, self._reset)
        # Twice as often as steps are due: a timer that is late skips calls.
        node.every(0.5e-9 * schedule.period_ns, self._tick)

    def _join(self, link: DriveLink) -> None:
        """Take torques and brakes from the controller inside the drives."""

        def command(topic: str, stamp_ns: int, row: Array) -> None:
            try:
                self._torque(stamp_ns, row, None)
            except InputError as err:
                self._refuse(topic, str(err))

        link.command, link.brake = command, self._plant.receive_brake
        link.now_ns = lambda: self._plant.now_ns(self._node.now_ns())

    def _subscribe(self, topics: Mapping[str, Topic], schedule: Schedule) -> None:
        """Hear torques, brakes and the safe state from the force controller."""
        node = self._node
        if TORQUE_COMMAND in schedule.topics:
            refuse = partial(self._refuse, TORQUE_COMMAND)
            node.subscribe_tagged_rows(topics[TORQUE_COMMAND], self._torque, refuse)
        if FORCE_CONTROLLER in schedule.nodes:
            for flag, take in (
                (BRAKE, self._plant.receive_brake),
                (SAFE, self._plant.receive_safe),
            ):
                BoundFlag(node, flag, FORCE_CONTROLLER, take, self._refuse)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self.leader.end_ns is not None

    @property
    def failure(self) -> str | None:
        """What ended the run, in one line, if anything did."""
        return self._plant.failure

    @property
    def simulated(self) -> float:
        """Time simulated [s]."""
        return self._simulator.plant.time

    def waiting(self) -> str:
        """Return what the start waits for; empty once the run has begun."""
        waits = self.leader.waits()
        return f"{PLANT} {waits}" if waits else ""

    def _on_wall_clock(self, node: ContractNode, topic: Topic, edge: Edges) -> Publish:
        publish: Callable[[int, int, Array], None] = node.publisher(topic, edge.readers)

        def send(log_ns: int, stamp_ns: int, row: Array) -> None:
            publish(log_ns, stamp_ns + self._start_ns, row)

        return send

    def _start(self, start_ns: int) -> None:
        self._start_ns = start_ns
        self._plant.start(start_ns)

    def _tick(self) -> None:
        fault = self._node.clock_fault()
        if fault is not None:
            self._line.report(fault)
        self._plant.tick(self._node.now_ns())
        if self._plant.failure is not None:
            self.leader.end()

    def _torque(self, stamp_ns: int, row: Array, gid: bytes | None) -> None:
        now_ns = self._plant.now_ns(self._node.now_ns())
        self._plant.receive_torque(stamp_ns, row, now_ns, gid)

    def _refuse(self, topic: str, reason: str) -> None:
        unbound = self._binding is not None and self._binding.bound is None
        if self.leader.start_ns is None and unbound:
            return
        self._plant.refuse(self._node.now_ns(), reason)
        self._node.complain(topic, reason)

    def _reset(self, _: object, response: object) -> object:
        refusal = self._watchdog.reset()
        response.success = refusal is None  # type: ignore[attr-defined]
        response.message = refusal or "running"  # type: ignore[attr-defined]
        return response
