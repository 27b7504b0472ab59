"""The simulated plant's node in real time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.graph import Edges
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.schedule import CLOCK, PLANT, TORQUE_COMMAND
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS, QOS_DEPTH, Topic
from cspm_sim.plant_run import PlantRun
from cspm_sim.realtime_plant import RealtimePlant
from cspm_sim.simulator import Publish
from cspm_sim.watchdog import Watchdog

Array = NDArray[np.float64]
RESET = "~/reset"


class RealtimePlantNode:
    """Steps the plant by the wall; it leads the run."""

    def __init__(self, node: ContractNode, run: PlantRun, watchdog: Watchdog) -> None:
        """Connect the plant to the ROS node; its watchdog releases or holds it."""
        topics, edges, schedule = run.topics, run.edges, run.schedule
        self._node, self._watchdog = node, watchdog
        self._start_ns = 0
        self._simulator = run.simulator(
            {
                name: self._on_wall_clock(node, topics[name], edge)
                for name, edge in run.published.items()
                if name != CLOCK
            }
        )
        status = node.status_publisher(edges[DIAGNOSTICS.name].readers)
        self._plant = RealtimePlant(self._simulator, schedule, run.steps, watchdog, status)
        self.leader = Leader(
            node,
            schedule.period_ns,
            run.others,
            # One period more, in which the last step is made.
            (run.steps + 1) * schedule.period_ns,
            on_start=self._start,
        )
        if TORQUE_COMMAND in schedule.topics:
            node.subscribe_rows(topics[TORQUE_COMMAND], self._torque, self._refuse)
        node.subscribe_objects(BRAKE.name, ros_class(BRAKE.ros_type), self._brake, QOS_DEPTH)
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), RESET, self._reset)
        # Twice as often as steps are due: a timer that is late skips calls.
        node.every(0.5e-9 * schedule.period_ns, self._tick)

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
        self._plant.tick(self._node.now_ns())
        if self._plant.failure is not None:
            self.leader.end()

    def _torque(self, stamp_ns: int, row: Array) -> None:
        self._plant.receive_torque(stamp_ns, row, self._node.now_ns())

    def _refuse(self, reason: str) -> None:
        self._plant.refuse(reason)
        self._node.complain(TORQUE_COMMAND, reason)

    def _brake(self, message: object) -> None:
        self._plant.receive_brake(bool(message.data))  # type: ignore[attr-defined]

    def _reset(self, _: object, response: object) -> object:
        refusal = self._watchdog.reset()
        response.success = refusal is None  # type: ignore[attr-defined]
        response.message = refusal or "running"  # type: ignore[attr-defined]
        return response
