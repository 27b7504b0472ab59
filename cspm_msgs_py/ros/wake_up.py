"""Sleep that ends when a message comes, for a loop that looks at its subscriptions itself."""

from __future__ import annotations

import ctypes
import os
import select
import sys

from cspm_msgs_py.ros.rcl.rcl_message import rcl_library


class WakeUp:
    """Waits for messages of the subscriptions that it watches, or for a time.

    The middleware calls the C library's `eventfd_write` itself, with the file that it was given and
    the number of messages: no thread of Python's is woken for a message.
    """

    def __init__(self) -> None:
        """Make it.

        Raises:
            OSError: rcl is not loaded as a library of its own, or the system has no such files.
            AttributeError: a function that it needs is missing.
        """
        if sys.maxsize != 2**63 - 1 or sys.byteorder != "little":
            # The file's number is passed as a pointer, and read as an int.
            raise OSError
        self._set = rcl_library("librcl.so").rcl_subscription_set_on_new_message_callback
        self._set.argtypes = [ctypes.c_void_p] * 3
        self._call = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p)
        self._file = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)

    def watch(self, subscription: int) -> None:
        """Let messages of rcl's subscription at an address end the sleep."""
        self._set(subscription, self._call, self._file)

    def forget(self, subscription: int) -> None:
        """Watch it no more; to be called before it is destroyed."""
        self._set(subscription, None, None)

    def wait(self, seconds: float) -> None:
        """Sleep for so long [s] at most, less if a message came since the last sleep."""
        if select.select([self._file], [], [], max(0.0, seconds))[0]:
            os.eventfd_read(self._file)

    def close(self) -> None:
        """Close the file; all subscriptions must have been forgotten."""
        os.close(self._file)


def make_wake_up() -> WakeUp | None:
    """Return one, None where the system has none."""
    try:
        return WakeUp()
    except (OSError, AttributeError):
        return None
