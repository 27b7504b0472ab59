"""Messages of which only numbers and stamps change, filled in where they are in the bytes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS
from cspm_msgs_py.ros_types import message_class, serialize

# No such second, half or quarter occurs by chance in a message that is otherwise constant.
_FIRST_MARK = 0x2A5B_3C01


class MarkedMessage:
    """One message's bytes, with the places of its stamps and numbers.

    The places are found by serialising marks: the serialiser alone knows the rules of alignment.
    """

    def __init__(
        self,
        build: Callable[[Sequence[Any], Sequence[float], Sequence[float]], Any],
        *,
        stamps: int,
        doubles: int,
        singles: int = 0,
    ) -> None:
        """Find the places.

        Args:
            build: returns the message from stamps (`builtin_interfaces/msg/Time`), numbers of
                double and of single precision; each is used once.
            stamps: how many stamps it takes.
            doubles: how many numbers of double precision it takes.
            singles: how many numbers of single precision it takes.

        Raises:
            InputError: a mark is not in the message once.
        """
        time = message_class("builtin_interfaces/msg/Time")
        marks = [_FIRST_MARK + i for i in range(stamps)]
        wide = [float(_FIRST_MARK + i) + 0.5 for i in range(doubles)]
        # Exact in single precision.
        narrow = [float(0x0051_0001 + i) / 16.0 for i in range(singles)]
        content = serialize(build([time(mark, mark) for mark in marks], wide, narrow))
        pairs = [np.array([mark, mark], "<u4").tobytes() for mark in marks]
        self._content = np.frombuffer(bytearray(content), np.uint8)
        self._stamps = _places(content, pairs, 8)
        self._doubles = _places(content, [np.float64(x).tobytes() for x in wide], 8)
        self._singles = _places(content, [np.float32(x).tobytes() for x in narrow], 4)

    def bytes_of(
        self,
        stamps_ns: Sequence[int],
        doubles: NDArray[np.float64],
        singles: NDArray[np.float64] | Sequence[float] = (),
    ) -> bytes:
        """Return the message with these stamps [ns] and numbers, in the order of `build`."""
        content = self._content
        pairs = np.array([divmod(stamp, NANOSECONDS) for stamp in stamps_ns], "<u4")
        content[self._stamps] = pairs.view(np.uint8)
        content[self._doubles] = np.asarray(doubles, "<f8").view(np.uint8).reshape(-1, 8)
        content[self._singles] = np.asarray(singles, "<f4").view(np.uint8).reshape(-1, 4)
        return content.tobytes()


def _places(content: bytes, marks: Sequence[bytes], width: int) -> NDArray[np.intp]:
    """Return the offsets of each mark's bytes, shape (n, width)."""
    wrong = [mark for mark in marks if content.count(mark) != 1]
    if wrong:
        raise InputError(f"{len(wrong)} marks are not in the message once, allowed: each once")
    starts = np.array([content.index(mark) for mark in marks], dtype=np.intp)
    return starts.reshape(-1, 1) + np.arange(width)
