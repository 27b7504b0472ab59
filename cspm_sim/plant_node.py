"""The simulated plant's node in lockstep."""

from __future__ import annotations

import time
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import followers
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.outbox import Outbox
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.rendezvous import PROGRESS, PlantSide
from cspm_msgs_py.schedule import TORQUE_COMMAND
from cspm_msgs_py.stepping.lockstep import WINDOW
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS
from cspm_sim.lockstep_plant import LockstepPlant
from cspm_sim.plant_run import PlantRun

Array = NDArray[np.float64]
_LOOK_EVERY_S = 0.02
# Who is not found by then was not there at the start.
_LOOK_AROUND_S = 2.0


class PlantNode:
    """Steps the plant as torque commands come; starts once all nodes of the run are connected.

    Attributes:
        started: whether the first state was published.
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(self, node: ContractNode, run: PlantRun) -> None:
        """Connect the plant to the ROS node."""
        topics, edges, schedule = run.topics, run.edges, run.schedule
        self._outbox = Outbox(node)
        simulator = run.simulator(
            {
                name: self._outbox.publisher(topics[name], edge.readers)
                for name, edge in run.published.items()
            },
            lambda: 0,
        )
        status = node.status_publisher(edges[DIAGNOSTICS.name].readers)
        waited_for = followers(schedule, run.nodes, WINDOW)
        self._node, self._simulator, self._period_ns = node, simulator, schedule.period_ns
        link = run.link
        observed = (lambda: None) if link is None else link.run
        self._plant = LockstepPlant(simulator, schedule, run.steps, waited_for, status, observed)
        self._others = PlantSide(node, schedule.period_ns, run.others, self._progress)
        if link is not None:
            link.command = lambda _, stamp_ns, row: self._torque(stamp_ns, row, None)
        elif TORQUE_COMMAND in schedule.topics:
            refuse = partial(self._refuse, TORQUE_COMMAND)
            node.subscribe_numbered_rows(topics[TORQUE_COMMAND], self._torque, refuse)
        node.node.create_subscription(
            ros_class(BRAKE.ros_type), BRAKE.name, self._brake, contract_qos()
        )
        self._brakes_at_start = run.plant.locked
        self._timer = node.every(_LOOK_EVERY_S, self._look_around)
        self._alone = 0.0
        self._end_reported = False
        self.started = False
        self.refused = (0, "")

    @property
    def ended(self) -> bool:
        """Whether the last step is done."""
        return self._plant.ended

    @property
    def finished(self) -> bool:
        """Whether the run is over and everybody has all of it."""
        return self._plant.finished

    @property
    def failure(self) -> str | None:
        """What ended the run, in one line, if anything did."""
        return self._plant.failure

    @property
    def simulated(self) -> float:
        """Time simulated [s]."""
        return (self._plant.last_step + 1) * self._period_ns * 1e-9

    @property
    def progress(self) -> int:
        """The last step whose state was published, −1 before the first."""
        return self._plant.last_step

    def stop(self) -> None:
        """End the run after the step underway."""
        self._plant.stop()
        self._send_rest()

    def waiting(self) -> str:
        """Return what the run waits for."""
        if not self.started:
            return f"plant waits for {', '.join(self._missing()) or 'its start'}"
        return self._plant.waiting()

    def _missing(self) -> list[str]:
        """Return what is not there yet: nodes, readers, or what nodes read from the user's own."""
        unmatched = self._others.unmatched()
        return unmatched or [f"own nodes to reach {name}" for name in sorted(self._others.apart)]

    def _look_around(self) -> None:
        """Start when all is there; end, when too late another run is found in this domain."""
        if not self.started:
            self._start()
        elif time.monotonic() > self._alone:
            self._timer.cancel()
        elif doubled := self._others.doubled():
            self._node.fail(f"plant: runs in {', '.join(doubled)}")

    def _start(self) -> None:
        # A plant that was stopped before has announced the end already.
        if not self._plant.ended and not self._missing():
            self._alone = time.monotonic() + _LOOK_AROUND_S
            self.started = True
            self._others.tell_start_at(0)
            self._plant.start()
            self._send_rest()

    def _torque(self, stamp_ns: int, row: Array, number: int | None) -> None:
        self._plant.receive_torque(stamp_ns, row, number)
        self._send_rest()

    def _brake(self, message: object) -> None:
        wanted = bool(message.data)  # type: ignore[attr-defined]
        self._simulator.plant.locked = wanted or self._brakes_at_start

    def _progress(self, name: str, step: int) -> None:
        try:
            self._plant.receive_progress(name, step)
        except InputError as err:
            self._refuse(PROGRESS, f"{PROGRESS}: {err}")
        self._send_rest()

    def _send_rest(self) -> None:
        """Send what nobody computes from and, once it is over, that it is."""
        self._outbox.send_rest()
        if self._plant.ended and not self._end_reported:
            self._end_reported = True
            self._others.tell_end(self._plant.last_step)

    def _refuse(self, topic: str, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
        self._node.complain(topic, reason)
