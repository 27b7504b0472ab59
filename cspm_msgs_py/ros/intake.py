"""Subscriptions that are looked at instead of waited for.

An executor spends 6 µs to dispatch a message and cannot pass on its sequence number; taking what
has come since the last look costs a third of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.type_support import check_for_type_support

from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.sequence_numbers import SequenceNumbers
from cspm_msgs_py.topics import QOS_RELIABILITY, Topic

# Long enough for a reader that is held up for a second.
DEPTH = 2000
# In one look, so that a flood does not keep its reader from all else.
_AT_ONCE = 2000


class Intake:
    """Subscribes to topics and hands on what came, topic by topic, at each `take`.

    Attributes:
        lost: messages missing by the numbers that their senders gave them, by topic.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._inlets: list[_Inlet | _BlockInlet | _ObjectInlet] = []

    @property
    def lost(self) -> dict[str, int]:
        """Messages missing by the numbers that their sender gave them, by topic."""
        return {inlet.topic: inlet.lost for inlet in self._inlets}

    def subscribe(
        self,
        topic: Topic,
        message_class: type,
        receive: Callable[[bytes, int, int | None], None],
        *,
        numbered: bool = True,
        reliability: str = QOS_RELIABILITY,
        depth: int | None = DEPTH,
    ) -> None:
        """Have `receive` called with each message's CDR bytes, time of reception [ns], and number.

        The number is its sender's, None where the middleware tells none. `numbered` says whether
        the numbers are to show losses: of one sender, and of others that may come and go.
        `reliability` is asked of them, the last `depth` messages wait, or all if None.
        """
        handle = self._handle(topic.name, message_class, reliability, depth)
        self._inlets.append(_Inlet(topic.name, handle, message_class, receive, numbered))

    def subscribe_blocks(
        self,
        topic: Topic,
        message_class: type,
        receive: Callable[[list[bytes], list[int | None]], None],
    ) -> None:
        """Have `receive` called with the CDR bytes and numbers of all that came between looks.

        All messages wait.
        """
        handle = self._handle(topic.name, message_class, QOS_RELIABILITY, None)
        self._inlets.append(_BlockInlet(topic.name, handle, message_class, receive))

    def subscribe_objects(
        self, topic: str, message_class: type, receive: Callable[[Any], None], depth: int | None
    ) -> None:
        """Have `receive` called with each message as rclpy's object; `depth` wait, all if None."""
        handle = self._handle(topic, message_class, QOS_RELIABILITY, depth)
        self._inlets.append(_ObjectInlet(topic, handle, message_class, receive))

    def _handle(
        self, topic: str, message_class: type, reliability: str, depth: int | None
    ) -> rclpy_implementation.Subscription:
        node = self._node
        check_for_type_support(message_class)
        with node.handle:
            return rclpy_implementation.Subscription(
                node.handle,
                message_class,
                node.resolve_topic_name(topic),
                contract_qos(depth, reliability=reliability).get_c_qos_profile(),
            )

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
        for inlet in self._inlets:
            inlet.take()

    def take_one(self) -> bool:
        """Hand on at most one message of each topic; return whether any had one."""
        moved = False
        for inlet in self._inlets:
            moved = inlet.take_one() or moved
        return moved

    def close(self) -> None:
        """Leave the topics."""
        for inlet in self._inlets:
            inlet.handle.destroy_when_not_in_use()
        self._inlets = []


def _take_each(take_one: Callable[[], bool]) -> None:
    for _ in range(_AT_ONCE):
        if not take_one():
            return


class _Inlet:
    """One subscription."""

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        message_class: type,
        receive: Callable[[bytes, int, int | None], None],
        numbered: bool,
    ) -> None:
        self.topic, self.handle = topic, handle
        self._class, self._receive = message_class, receive
        self._numbers = SequenceNumbers() if numbered else None

    @property
    def lost(self) -> int:
        """Messages missing by their numbers."""
        return self._numbers.lost if self._numbers is not None else 0

    def take_one(self) -> bool:
        taken = self.handle.take_message(self._class, True)
        if taken is None:
            return False
        payload, info = taken
        number = info["publication_sequence_number"]
        if self._numbers is not None and number is not None:
            self._numbers.add(number)
        self._receive(payload, info["received_timestamp"], number)
        return True

    def take(self) -> None:
        _take_each(self.take_one)


class _BlockInlet:
    """One subscription whose messages are handed on together, to someone who counts them."""

    lost = 0

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        message_class: type,
        receive: Callable[[list[bytes], list[int | None]], None],
    ) -> None:
        self.topic, self.handle = topic, handle
        self._class, self._receive = message_class, receive

    def take_one(self) -> bool:
        return self._take(1)

    def take(self) -> None:
        self._take(_AT_ONCE)

    def _take(self, most: int) -> bool:
        take, message_class = self.handle.take_message, self._class
        payloads: list[bytes] = []
        numbers: list[int | None] = []
        while len(payloads) < most and (taken := take(message_class, True)) is not None:
            payload, info = taken
            payloads.append(payload)
            numbers.append(info["publication_sequence_number"])
        if payloads:
            self._receive(payloads, numbers)
        return bool(payloads)


class _ObjectInlet:
    """One subscription whose messages are handed on as rclpy's objects."""

    lost = 0

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        message_class: type,
        receive: Callable[[Any], None],
    ) -> None:
        self.topic, self.handle = topic, handle
        self._class, self._receive = message_class, receive

    def take_one(self) -> bool:
        taken = self.handle.take_message(self._class, False)
        if taken is None:
            return False
        self._receive(taken[0])
        return True

    def take(self) -> None:
        _take_each(self.take_one)
