"""Subscriptions that are looked at instead of waited for.

An executor spends 6 µs to dispatch a message and cannot pass on its sequence number; taking what
has come since the last look costs a third of it, and less where rows are taken from rcl itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.type_support import check_for_type_support

from cspm_msgs_py.ros.inlets import (
    BlockInlet,
    DueInlet,
    DueReceiver,
    Inlet,
    ObjectInlet,
    RowInlet,
    RowStore,
    StoreInlet,
    TaggedInlet,
)
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.rcl.rcl_message import take_address
from cspm_msgs_py.ros.rcl.row_taker import RowTaker
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged, TaggedTaker, UntaggedTaker, make_taker
from cspm_msgs_py.ros.wake_up import WakeUp
from cspm_msgs_py.topics import QOS_RELIABILITY, Topic

Array = NDArray[np.float64]
_Inlet = Inlet | BlockInlet | ObjectInlet | RowInlet | DueInlet | TaggedInlet
# Long enough for a reader that is held up for a second.
DEPTH = 2000


class Intake:
    """Subscribes to topics and hands on what came, topic by topic, at each `take`.

    Attributes:
        lost: messages missing by the numbers that their senders gave them, by topic.
    """

    def __init__(self, node: Node, wake_up: WakeUp | None = None) -> None:
        """Subscribe as `node`; what comes ends the sleep of `wake_up`."""
        self._node, self._wake_up = node, wake_up
        self._inlets: list[_Inlet] = []
        self._takers: list[RowTaker | TaggedTaker | UntaggedTaker] = []

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

        The number is its sender's, None where the middleware gives none. `numbered` says whether
        the numbers are to show losses: of one sender, and of others that may come and go.
        `reliability` is asked of them, the last `depth` messages wait, or all if None.
        """
        handle = self._handle(topic.name, message_class, reliability, depth)
        self._inlets.append(Inlet(topic.name, handle, message_class, receive, numbered))

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
        self._inlets.append(BlockInlet(topic.name, handle, message_class, receive))

    def subscribe_rows(
        self,
        topic: Topic,
        message_class: type,
        receive: Callable[[int, Array, int | None], None],
        receive_bytes: Callable[[bytes, int, int | None], None],
    ) -> None:
        """Have `receive` called with each message's stamp [ns], row and number.

        What is not intact and in the contract's own bytes goes to `receive_bytes` as in `subscribe`
        with numbers that mean nothing, and so does all where rcl cannot be called. All messages
        wait.
        """
        handle = self._handle(topic.name, message_class, QOS_RELIABILITY, None)
        taker = self._taker(topic, handle)
        self._inlets.append(
            Inlet(topic.name, handle, message_class, receive_bytes, False)
            if taker is None
            else RowInlet(topic.name, handle, taker, receive, receive_bytes)
        )

    def subscribe_due(self, topic: Topic, message_class: type, receiver: DueReceiver) -> None:
        """Have `receiver` take all that came between looks: what is due as rows, else as bytes.

        Where rcl cannot be called all comes as bytes. All messages wait.
        """
        handle = self._handle(topic.name, message_class, QOS_RELIABILITY, None)
        taker = self._taker(topic, handle)
        self._inlets.append(
            BlockInlet(topic.name, handle, message_class, receiver.receive)
            if taker is None
            else DueInlet(topic.name, handle, message_class, taker, receiver)
        )

    def subscribe_tagged(
        self,
        topic: Topic,
        message_class: type,
        receive: Callable[[Tagged], None],
        *,
        depth: int | None = DEPTH,
        store: RowStore | None = None,
    ) -> None:
        """Have `receive` called with each message and its publisher's identity; see `subscribe`.

        With a `store` messages are numbered. It takes rows of the publisher that it names, and
        `receive` all else.
        """
        handle = self._handle(topic.name, message_class, QOS_RELIABILITY, depth)
        taker = make_taker(handle, message_class)
        self._takers.append(taker)
        rows = None if store is None else self._taker(topic, handle)
        if store is None or rows is None:
            numbered = store is not None
            self._inlets.append(TaggedInlet(topic.name, handle, taker, receive, numbered))
            return
        self._inlets.append(StoreInlet(topic.name, handle, taker, receive, rows, store))

    def subscribe_objects(
        self, topic: str, message_class: type, receive: Callable[[Any], None], depth: int | None
    ) -> None:
        """Have `receive` called with each message as rclpy's object; `depth` wait, all if None."""
        handle = self._handle(topic, message_class, QOS_RELIABILITY, depth)
        self._inlets.append(ObjectInlet(topic, handle, message_class, receive))

    def _handle(
        self, topic: str, message_class: type, reliability: str, depth: int | None
    ) -> rclpy_implementation.Subscription:
        node = self._node
        check_for_type_support(message_class)
        with node.handle:
            handle = rclpy_implementation.Subscription(
                node.handle,
                message_class,
                node.resolve_topic_name(local(topic)),
                contract_qos(depth, reliability=reliability).get_c_qos_profile(),
            )
        if self._wake_up is not None:
            self._wake_up.watch(handle.pointer)
        return handle

    def _taker(self, topic: Topic, handle: rclpy_implementation.Subscription) -> RowTaker | None:
        """Return what takes a topic's rows without rclpy, None where rcl cannot be called."""
        address = take_address()
        if address is None:
            return None
        taker = RowTaker(topic, handle.pointer, address)
        self._takers.append(taker)
        return taker

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
            if self._wake_up is not None:
                self._wake_up.forget(inlet.handle.pointer)
            inlet.handle.destroy_when_not_in_use()
        for taker in self._takers:
            taker.close()
        self._inlets, self._takers = [], []
