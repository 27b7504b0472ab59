"""What rcl's own functions take messages into and send them from."""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache

import numba
import numpy as np
from numpy.typing import NDArray

_WORD_BYTES = 8


class _Allocator(ctypes.Structure):
    """`rcutils_allocator_t`: four functions and their state."""

    _fields_ = [(f"word{i}", ctypes.c_void_p) for i in range(5)]


class _Message(ctypes.Structure):
    """`rcl_serialized_message_t`, and behind it `rmw_message_info_t` with room to spare."""

    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
        ("info", ctypes.c_int64 * 16),
    ]


class RclMessage:
    """A serialised message that rcl writes to, and for which it makes more room where it has to.

    Attributes:
        address: of the message.
        info_address: of what the middleware knows of it: times of sending and reception, number.
        state: both as words, (24,).
    """

    def __init__(self, words: int) -> None:
        """Make room for so many words of 8 bytes.

        Raises:
            MemoryError: there is none.
        """
        rcutils = rcl_library("librcutils.so")
        rcutils.rcutils_get_default_allocator.restype = _Allocator
        allocator = rcutils.rcutils_get_default_allocator()
        self._message = _Message()
        self._finish = rcutils.rcutils_uint8_array_fini
        self.address = ctypes.addressof(self._message)
        self.info_address = self.address + _Message.info.offset
        self.state: NDArray[np.int64] = np.frombuffer(memoryview(self._message), np.int64)
        size = ctypes.c_size_t(words * _WORD_BYTES)
        if rcutils.rcutils_uint8_array_init(
            ctypes.c_void_p(self.address), size, ctypes.byref(allocator)
        ):
            raise MemoryError

    @property
    def buffer(self) -> int:
        """Address of the content."""
        return int(self._message.buffer)

    def room(self, words: int) -> NDArray[np.uint64]:
        """Return the first words of the buffer, as they are now and will be while it stays."""
        place = (ctypes.c_uint64 * words).from_address(self.buffer)
        return np.frombuffer(memoryview(place), np.uint64)

    def fill(self, content: bytes) -> None:
        """Make it a message of these bytes, for which there has to be room."""
        ctypes.memmove(self.buffer, content, len(content))
        self._message.length = len(content)

    @property
    def content(self) -> bytes:
        """The message that was taken last."""
        return ctypes.string_at(self.buffer, self._message.length)

    def close(self) -> None:
        """Give the room back."""
        self._finish(ctypes.c_void_p(self.address))


def take_address() -> int | None:
    """Return the address of `rcl_take_serialized_message`, None where it cannot be called."""
    return _address("rcl_take_serialized_message")


def publish_address() -> int | None:
    """Return the address of `rcl_publish_serialized_message`, None where it cannot be called."""
    return _address("rcl_publish_serialized_message")


@cache
def _address(name: str) -> int | None:
    # What is compiled assumes this order and size of words, and that it is compiled.
    if numba.config.DISABLE_JIT or sys.byteorder != "little" or sys.maxsize != 2**63 - 1:
        return None
    try:
        function = getattr(rcl_library("librcl.so"), name)
        rcutils = rcl_library("librcutils.so")
        found = rcutils.rcutils_uint8_array_init, rcutils.rcutils_uint8_array_fini
        _ = (*found, rcutils.rcutils_get_default_allocator)
    except (OSError, AttributeError):
        return None
    return ctypes.cast(function, ctypes.c_void_p).value


def clear_error() -> None:
    """Forget the last error of rcl in this thread, which the next one would complain about.

    Raises:
        OSError: rclpy is not loaded.
    """
    rcl_library("librcutils.so").rcutils_reset_error()


def rcl_library(name: str) -> ctypes.CDLL:
    """Return a library that rclpy has loaded: another copy would not know its subscriptions.

    Raises:
        OSError: it has loaded none of this name.
    """
    return ctypes.CDLL(name, mode=os.RTLD_NOW | os.RTLD_NOLOAD)
