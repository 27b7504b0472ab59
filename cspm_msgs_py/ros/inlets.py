"""Single subscriptions that are looked at, by what they hand on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.impl.implementation_singleton import rclpy_implementation

from cspm_msgs_py.ros.rcl.row_taker import RowTaker, TakenRow
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged, TaggedTaker, UntaggedTaker
from cspm_msgs_py.stepping.sequence_numbers import SequenceNumbers

Array = NDArray[np.float64]
Words = NDArray[np.int64]
# In one look, so that a flood does not keep its reader from all else.
_AT_ONCE = 2000


class DueReceiver(Protocol):
    """Who knows which of a topic's messages comes next."""

    @property
    def due(self) -> tuple[int, int, int]:
        """The next message's stamp, from it to the one after [ns], and its sender's number."""

    def receive_rows(self, rows: Array) -> None:
        """Take the rows of messages that are due, shape (n, width), valid during the call."""

    def receive_other(self, payload: bytes, number: int | None) -> None:
        """Take a message that is not due, or not as it should be: CDR bytes, sender's number."""

    def receive(self, payloads: list[bytes], numbers: list[int | None]) -> None:
        """Take messages of which nothing is known: CDR bytes, senders' numbers."""


def _take_each(take_one: Callable[[], bool]) -> None:
    for _ in range(_AT_ONCE):
        if not take_one():
            return


class Inlet:
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
        """Hand on a message, if there is one; return whether there was."""
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
        """Hand on what has come, of a flood its beginning."""
        _take_each(self.take_one)


class TaggedInlet:
    """One subscription whose messages are handed on with their publisher's identity."""

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        taker: TaggedTaker | UntaggedTaker,
        receive: Callable[[Tagged], None],
        numbered: bool,
    ) -> None:
        self.topic, self.handle = topic, handle
        self._taker, self._receive = taker, receive
        self._numbers = SequenceNumbers() if numbered else None

    @property
    def lost(self) -> int:
        """Messages missing by their numbers."""
        return self._numbers.lost if self._numbers is not None else 0

    def take_one(self) -> bool:
        """Hand on a message, if there is one; return whether there was."""
        taken = self._taker.take()
        if taken is None:
            return False
        self._hand_on(taken)
        return True

    def _hand_on(self, taken: Tagged) -> None:
        if self._numbers is not None and taken.number is not None:
            self._numbers.add(taken.number)
        self._receive(taken)

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
        _take_each(self.take_one)


class RowStore(Protocol):
    """Who keeps a topic's rows."""

    @property
    def publisher(self) -> bytes | None:
        """Whose messages are stored without a look at each (16 bytes); None: nobody's."""

    def room(self) -> tuple[Words, Array]:
        """Return where the next go: stamps and times of reception [ns], (n, 2), rows, (n, width).

        There is room for one at least.
        """

    def stored(self, count: int) -> None:
        """Note that so many were put there."""


class StoreInlet(TaggedInlet):
    """One subscription of which one publisher's messages are stored, and others handed on."""

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        taker: TaggedTaker | UntaggedTaker,
        receive: Callable[[Tagged], None],
        row_taker: RowTaker,
        store: RowStore,
    ) -> None:
        super().__init__(topic, handle, taker, receive, numbered=True)
        self._numbers = self._own_numbers = SequenceNumbers()
        self._row_taker, self._store = row_taker, store
        # The publisher's identity and its next number.
        self._own = np.zeros(3, dtype=np.int64)
        # Compiles or loads what takes them, so that the run's first messages need not wait for it.
        times, rows = store.room()
        row_taker.take_own(self._own, times[:0], rows[:0])

    def take(self) -> None:
        """Hand on or store what has come, of a flood its beginning."""
        left = _AT_ONCE
        while left > 0:
            publisher, following = self._store.publisher, self._own_numbers.following
            if publisher is None or following is None:
                super().take()
                return
            self._own[:2] = np.frombuffer(publisher, dtype=np.int64)
            self._own[2] = following
            times, rows = self._store.room()
            count, other = self._row_taker.take_own(self._own, times, rows)
            if count:
                self._own_numbers.skip(count)
                self._store.stored(count)
            if other is not None:
                self._hand_on(other)
            elif count < len(rows):
                return
            left -= count + 1


class BlockInlet:
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
        """Hand on a message, if there is one; return whether there was."""
        return self._take(1)

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
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


class ObjectInlet:
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
        """Hand on a message, if there is one; return whether there was."""
        taken = self.handle.take_message(self._class, False)
        if taken is None:
            return False
        self._receive(taken[0])
        return True

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
        _take_each(self.take_one)


class RowInlet:
    """One subscription whose messages are handed on as rows, one by one."""

    lost = 0

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        taker: RowTaker,
        receive: Callable[[int, Array, int | None], None],
        receive_bytes: Callable[[bytes, int, int | None], None],
    ) -> None:
        self.topic, self.handle, self._taker = topic, handle, taker
        self._receive, self._receive_bytes = receive, receive_bytes

    def take_one(self) -> bool:
        """Hand on a message, if there is one; return whether there was."""
        taken = self._taker.take()
        if taken is None:
            return False
        if isinstance(taken, TakenRow):
            self._receive(*taken)
        else:
            self._receive_bytes(taken.payload, 0, taken.number)
        return True

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
        _take_each(self.take_one)


class DueInlet(BlockInlet):
    """One subscription whose messages are handed on as rows as long as they are due."""

    def __init__(
        self,
        topic: str,
        handle: rclpy_implementation.Subscription,
        message_class: type,
        taker: RowTaker,
        receiver: DueReceiver,
    ) -> None:
        super().__init__(topic, handle, message_class, receiver.receive)
        self._taker, self._receiver = taker, receiver

    def take(self) -> None:
        """Hand on what has come, of a flood its beginning."""
        receiver, left = self._receiver, _AT_ONCE
        while left > 0:
            rows, other = self._taker.take_due(*receiver.due, left)
            left -= len(rows)
            if len(rows):
                receiver.receive_rows(rows)
            if other is not None:
                receiver.receive_other(*other)
                # Where one does not belong there are more, which cost less together.
                super().take()
                return
            if not len(rows):
                return
