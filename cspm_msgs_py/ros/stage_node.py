"""A controller's node in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.graph import Edges
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.guard_ports import GuardPorts
from cspm_msgs_py.ros.outbox import Outbox
from cspm_msgs_py.ros.own_senders import OwnSenders
from cspm_msgs_py.ros.rendezvous import FollowerSide
from cspm_msgs_py.schedule import PLANT, TORQUE_COMMAND, Schedule
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.stepping.lockstep import Acknowledgement, Follower
from cspm_msgs_py.stepping.stage import Guard, Stage
from cspm_msgs_py.topics import DIAGNOSTICS, Topic

Array = NDArray[np.float64]
Publish = Callable[[int, int, Array], None]


def commanding(publish: Publish, link: DriveLink) -> Publish:
    """Return what publishes torque commands, and keeps them for the plant."""

    def send(log_ns: int, stamp_ns: int, row: Array) -> None:
        link.order(TORQUE_COMMAND, stamp_ns, row)
        publish(log_ns, stamp_ns, row)

    return send


class StageNode:
    """Feeds a stage with messages as the lockstep schedule requires.

    Attributes:
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        node: ContractNode,
        stage: Stage,
        schedule: Schedule,
        topics: Mapping[str, Topic],
        edges: Mapping[str, Edges],
        *,
        tells_progress: bool,
        guard: Guard | None = None,
        own: Collection[str] = (),
        link: DriveLink | None = None,
    ) -> None:
        """Connect the stage.

        Args:
            node: the ROS node, named as the stage.
            stage: the controller.
            schedule: of the run.
            topics: of the test-bed, by name.
            edges: who reads what in this run.
            tells_progress: whether the plant waits for this node's progress.
            guard: the stage itself where it has a safe state.
            own: nodes that are programs of the user's, whose topics have to be there before it is
                ready.
            link: to the plant that the stage is part of; None: it is a node of its own.
        """
        plan = schedule.nodes[stage.node]
        self._node = node
        self._acknowledgement = Acknowledgement() if tells_progress else None
        self._outbox = outbox = Outbox(node)
        publish = {n: outbox.publisher(topics[n], edges[n].readers) for n in plan.outputs}
        receive = self._receive_and_tell if tells_progress else self._receive
        if link is not None:
            publish[TORQUE_COMMAND] = commanding(publish[TORQUE_COMMAND], link)
            link.receive = lambda topic, stamp_ns, row: receive(topic, stamp_ns, row, None)
        status = node.status_publisher(edges[DIAGNOSTICS.name].readers)
        self._follower = Follower(stage, schedule, publish, status)
        senders = OwnSenders(node, schedule, own, (*plan.inputs, *plan.held))
        self._link = link
        self._plant = FollowerSide(node, schedule.period_ns, self._end, ready=senders.ready)
        for name in (*plan.inputs, *plan.held):
            if link is not None and edges[name].senders == (PLANT,):
                continue
            refuse = partial(self._refuse, name)
            node.subscribe_numbered_rows(topics[name], partial(receive, name), refuse)
        if guard is not None:
            GuardPorts(node, guard, self._now_ns)
        self.refused = (0, "")

    @property
    def end_known(self) -> bool:
        """Whether the plant has announced with which step the run ends."""
        return self._plant.end_step is not None

    @property
    def ended(self) -> bool:
        """Whether the plant has ended the run, and this node has read and computed all of it.

        Who computes seldom has nothing left to compute before it has read, and so reported, all.
        """
        last = self._plant.end_step
        return last is not None and self._follower.reached >= last

    @property
    def progress(self) -> int:
        """The plant step through which this node is complete."""
        return self._follower.completed

    def waiting(self) -> str:
        """Return what the node waits for."""
        return self._follower.waiting()

    def _receive(self, topic: str, stamp_ns: int, row: Array, number: int | None) -> None:
        self._follower.receive(topic, stamp_ns, row, number)
        self._outbox.send_rest()
        if self._link is not None:
            self._link.run()

    def _receive_and_tell(self, topic: str, stamp_ns: int, row: Array, number: int | None) -> None:
        self._receive(topic, stamp_ns, row, number)
        self._tell()

    def _tell(self) -> None:
        reached = self._follower.reached
        if self._acknowledgement is not None and self._acknowledgement.due(reached):
            self._plant.report(reached)

    def _end(self, last_step: int) -> None:
        self._follower.check_end(last_step)
        if self._acknowledgement is not None:
            self._acknowledgement.last = last_step
            self._tell()

    def _now_ns(self) -> int:
        """Return the instant that was computed last [ns]: lockstep knows no other time."""
        return self._follower.now_ns

    def _refuse(self, topic: str, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
        # What is refused changes nothing, the safe state included: that is for real time.
        self._node.complain(topic, reason)
