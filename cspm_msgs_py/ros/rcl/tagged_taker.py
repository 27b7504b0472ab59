"""A subscription's messages with the identity of their publisher, which rclpy does not pass on."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation

from cspm_msgs_py.ros.rcl.rcl_message import RclMessage, rcl_library

_TAKEN = 0
_WORDS = 64
# `rmw_message_info_t` behind the 8 words of the message: times of sending and reception, numbers
# of sending and reception, the middleware's name, and 16 bytes that identify the publisher.
_RECEIVED, _NUMBER, _GID = 9, 10, slice(13, 15)
_UNKNOWN = -1


class Tagged(NamedTuple):
    """A message as it came.

    Attributes:
        payload: its CDR bytes.
        received_ns: when the middleware received it [ns].
        number: that its sender gave it, None if unknown.
        gid: what identifies its publisher (16 bytes), None where rcl does not say.
    """

    payload: bytes
    received_ns: int
    number: int | None
    gid: bytes | None


class TaggedTaker:
    """Takes the messages of one subscription by rcl's own function. Use it from one thread."""

    def __init__(self, subscription: int) -> None:
        """Take the address of rcl's subscription, which has to outlive this.

        Raises:
            OSError: rcl is not loaded as a library of its own.
            AttributeError: it does not have the function.
        """
        self._take = rcl_library("librcl.so").rcl_take_serialized_message
        self._take.argtypes = [ctypes.c_void_p] * 4
        self._message = RclMessage(_WORDS)
        self._arguments = subscription, self._message.address, self._message.info_address, None

    def take(self) -> Tagged | None:
        """Return the next message, None if there is none."""
        message = self._message
        if self._take(*self._arguments) != _TAKEN:
            return None
        state = message.state
        number = int(state[_NUMBER])
        return Tagged(
            message.content,
            int(state[_RECEIVED]),
            None if number == _UNKNOWN else number,
            state[_GID].tobytes(),
        )

    def close(self) -> None:
        """Give its memory back; nothing can be taken then."""
        self._message.close()


class UntaggedTaker:
    """Takes them by rclpy, where rcl cannot be called: nobody knows their publishers."""

    def __init__(self, handle: rclpy_implementation.Subscription, message_class: type) -> None:
        """Take the subscription and the type of its messages."""
        self._handle, self._class = handle, message_class

    def take(self) -> Tagged | None:
        """Return the next message, None if there is none."""
        taken = self._handle.take_message(self._class, True)
        if taken is None:
            return None
        payload, info = taken
        number = info["publication_sequence_number"]
        return Tagged(payload, info["received_timestamp"], number, None)

    def close(self) -> None:
        """Nothing to give back."""


def make_taker(
    handle: rclpy_implementation.Subscription, message_class: type
) -> TaggedTaker | UntaggedTaker:
    """Return what takes the messages of a subscription, with their publishers if rcl tells."""
    try:
        return TaggedTaker(handle.pointer)
    except (OSError, AttributeError):
        return UntaggedTaker(handle, message_class)
