"""The nodes of a run find each other, start and end together.

Followers report to the leader, a simulated plant where there is one, on `/run/progress`
that they are connected (stamp −1 s), or are but for somebody else's drivers (−2 s), or but for the
proof of these (−3 s), which the leader asks for on `/run/start` (−3 s) again and again once all
else is there; in lockstep also, later, through which instant they are complete. The leader
announces on `/run/start` that the run begins, in real time at which instant the motions do. It
announces on `/run/end` at which instant the run ended.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Collection

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.domain_claim import START
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos

PROGRESS, END = "/run/progress", "/run/end"
_HEADER = "std_msgs/msg/Header"
_NANOSECONDS = 1_000_000_000
_LOOK_EVERY_S = 0.05
_READY, _APART, _PROVING = -1, -2, -3
# Proofs are asked for so often [s]: each node of a process takes one such message in its turn.
_ASK_EVERY_S, _ASKED_S = 0.5, 1.5
# How long it may take on one machine until all who are there are seen.
SETTLE_S = 0.5


class FollowerSide:
    """A follower's side.

    Attributes:
        end_ns: the instant at which the run ended [ns], once the leader has announced it.
    """

    def __init__(
        self,
        node: ContractNode,
        period_ns: int,
        on_end: Callable[[int], None] = lambda _: None,
        on_start: Callable[[int], None] = lambda _: None,
        ready: Callable[[], bool] = lambda: True,
        proving: Callable[[], bool] = lambda: False,
    ) -> None:
        """Announce the node as soon as all its readers are connected, again and again.

        Neither start nor end prove that the leader has heard of it: anybody can send those.

        Args:
            node: the node.
            period_ns: the plant's [ns].
            on_end: called with the last step of a lockstep run; raises `InputError` if that cannot
                be this run's.
            on_start: called with the first instant [ns] of a run in real time.
            ready: whether the node is connected to what is not of this run, looked at in turn.
            proving: whether nothing is left but drivers that have to prove what they are.
        """
        self._node, self._ready, self._proving = node, ready, proving
        self._period_ns = period_ns
        self._on_end = on_end
        self._header = ros_class(_HEADER)
        self._publisher = node.node.create_publisher(self._header, local(PROGRESS), contract_qos())
        self._on_start = on_start
        node.node.create_subscription(self._header, local(START), self._start, contract_qos(None))
        node.node.create_subscription(self._header, local(END), self._end, contract_qos(None))
        self._connected, self._asked = False, -_ASKED_S
        self._timer = node.every(_LOOK_EVERY_S, self._announce)
        self.end_ns: int | None = None

    @property
    def end_step(self) -> int | None:
        """The last step of a lockstep run, once the plant has announced it."""
        return None if self.end_ns is None else self.end_ns // self._period_ns

    def report(self, step: int) -> None:
        """Report that this node is complete through `step`."""
        self._timer.cancel()
        self._send(step * self._period_ns)

    def _announce(self) -> None:
        if not self._connected:
            heard = bool(self._publisher.get_subscription_count())
            self._connected = heard and not self._node.unmatched()
        if self._connected:
            unready = _PROVING if self._proving() else _APART
            self._send((_READY if self._ready() else unready) * _NANOSECONDS)

    def _send(self, stamp_ns: int) -> None:
        message = self._header(frame_id=self._node.name)
        message.stamp.sec, message.stamp.nanosec = divmod(stamp_ns, _NANOSECONDS)
        self._publisher.publish(message)

    def asked(self) -> bool:
        """Return whether the leader asks for proofs."""
        return time.monotonic() - self._asked < _ASKED_S

    def _end(self, message: object) -> None:
        end_ns = _stamp_of(message)
        try:
            self._on_end(end_ns // self._period_ns)
        except InputError as err:
            self._node.complain(END, f"{END}: {err}")
            return
        self.end_ns = end_ns

    def _start(self, message: object) -> None:
        stamp_ns = _stamp_of(message)
        if stamp_ns < 0:
            self._asked = time.monotonic()
        else:
            self._on_start(stamp_ns)


class PlantSide:
    """The leader's side.

    Attributes:
        absent: nodes of the run that have not announced themselves yet.
        apart: nodes that have, and are not connected to somebody else's drivers yet.
        proving: nodes that have, and are to have those drivers prove what they are.
    """

    def __init__(
        self,
        node: ContractNode,
        period_ns: int,
        others: Collection[str],
        on_progress: Callable[[str, int], None],
    ) -> None:
        """Listen to `others`, the nodes that belong to the run beside the leader."""
        self._node = node
        self._period_ns = period_ns
        self._others = frozenset(others)
        self._on_progress = on_progress
        self._header = ros_class(_HEADER)
        self._publisher = node.node.create_publisher(self._header, local(END), contract_qos())
        self._starter = node.node.create_publisher(self._header, local(START), contract_qos())
        node.subscribe_objects(PROGRESS, self._header, self._take)
        self._settled = time.monotonic() + SETTLE_S
        self.absent = set(others)
        self.apart: set[str] = set()
        self.proving: set[str] = set()
        self._asked = -_ASK_EVERY_S

    def unmatched(self) -> list[str]:
        """Return what is still missing before the run can start.

        Of the nodes first those that are not there at all, then readers of ours that announce
        nothing: others may be waiting for them.
        """
        if self.absent:
            there = self._senders(self._node.node.resolve_topic_name(local(PROGRESS)))
            away = sorted(self.absent - set(there))
            return away or self._node.unmatched() or sorted(self.absent)
        for publisher in (self._starter, self._publisher):
            deaf = self._node.unconnected(publisher, self._others)
            if deaf:
                return [f"{publisher.topic_name} ({', '.join(deaf)})"]
        if time.monotonic() < self._settled:
            return ["who else is in this ROS domain"]
        return self.doubled() or self._node.unmatched()

    def doubled(self) -> list[str]:
        """Return which of the run's names stand for more than one node, as in two runs at once."""
        names = {self._publisher.topic_name: {self._node.name}}
        names[self._node.node.resolve_topic_name(local(PROGRESS))] = set(self._others)
        return [
            f"one node {name} instead of {count} (ROS_DOMAIN_ID keeps runs apart)"
            for topic, wanted in names.items()
            for name, count in self._senders(topic).items()
            if name in wanted and count > 1
        ]

    def _senders(self, topic: str) -> Counter[str]:
        found = self._node.node.get_publishers_info_by_topic(topic)
        return Counter(str(info.node_name) for info in found)

    def tell_end(self, step: int) -> None:
        """Announce that a lockstep run ended with `step`."""
        self.tell_end_at(step * self._period_ns)

    def tell_end_at(self, stamp_ns: int) -> None:
        """Announce at which instant [ns] the run ended."""
        self._publisher.publish(self._stamped(stamp_ns))

    def tell_start_at(self, stamp_ns: int) -> None:
        """Announce at which instant [ns] the run begins: on the ROS clock, in lockstep 0."""
        self._starter.publish(self._stamped(stamp_ns))

    def ask_for_proofs(self) -> None:
        """Have those that are to prove somebody's drivers do so: all else is there."""
        now = time.monotonic()
        if now - self._asked >= _ASK_EVERY_S:
            self._asked = now
            self._starter.publish(self._stamped(_PROVING * _NANOSECONDS))

    def _stamped(self, stamp_ns: int) -> object:
        message = self._header(frame_id=self._node.name)
        message.stamp.sec, message.stamp.nanosec = divmod(stamp_ns, _NANOSECONDS)
        return message

    def _take(self, message: object) -> None:
        name, total = message.frame_id, _stamp_of(message)  # type: ignore[attr-defined]
        self.absent.discard(name)
        for code, names in ((_APART, self.apart), (_PROVING, self.proving)):
            (names.add if total == code * _NANOSECONDS else names.discard)(name)
        if total >= 0 and name in self._others:
            self._on_progress(name, total // self._period_ns)


def _stamp_of(message: object) -> int:
    stamp = message.stamp  # type: ignore[attr-defined]
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)
