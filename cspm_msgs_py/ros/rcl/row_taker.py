"""A topic's rows as they come from the middleware, taken and read in compiled code.

One by one it takes half the time of rclpy and `WireReader`, in blocks a fifth. What is not exactly
as it should be comes as bytes, for `WireReader` to judge.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.ros.rcl import take_kernel as kernel
from cspm_msgs_py.ros.rcl.rcl_message import RclMessage, clear_error
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged
from cspm_msgs_py.topics import POSE, Topic
from cspm_msgs_py.wire import mask_of

Array = NDArray[np.float64]
Words = NDArray[np.int64]
_MOST_ROWS = 64


class TakenRow(NamedTuple):
    """An intact message: stamp [ns], row (width,), and its sender's number, None if unknown."""

    stamp_ns: int
    row: Array
    number: int | None


class TakenBytes(NamedTuple):
    """Any other message: its CDR bytes, and its sender's number, None if unknown."""

    payload: bytes
    number: int | None


class TakenRows(NamedTuple):
    """What a look found.

    Attributes:
        rows: of the messages that were due, shape (n, width), valid until the next look.
        other: the message after them, if that is not as it should be.
    """

    rows: Array
    other: TakenBytes | None


class RowTaker:
    """Takes the messages of one subscription. Use it from one thread."""

    def __init__(self, topic: Topic, subscription: int, take: int) -> None:
        """Prepare what messages are compared with.

        Args:
            topic: the topic.
            subscription: address of rcl's subscription, which has to outlive this.
            take: address of `rcl_take_serialized_message`.

        Raises:
            InputError: the topic's type carries no row, or its columns do not fit its names.
        """
        layout, mask = layout_of(topic), mask_of(layout_of(topic))
        self._topic, self._words = topic, -(-layout.size // 8)
        same = np.zeros((2, 8 * self._words), dtype=np.uint8)
        same[:, : layout.size] = mask, mask & layout.template
        self._same = same.view(np.uint64)
        self._message = message = RclMessage(self._words)
        addresses = take, subscription, message.address, message.info_address, message.buffer
        has_pose = topic.fields[: len(POSE)] == POSE
        form = (*addresses, layout.size, layout.seconds // 4, has_pose)
        self._places = layout.halves
        self._form = np.array(form, dtype=np.int64)
        self._found, self._due = np.zeros(2, dtype=np.int64), np.zeros(3, dtype=np.int64)
        self._row, self._rows = np.empty(topic.width), np.empty((_MOST_ROWS, topic.width))
        self._find_buffer()

    def _find_buffer(self) -> None:
        """Look where the content lies, which rcl moves when a message does not fit in."""
        message, content = self._message, self._message.room(self._words)
        self._form[kernel.BUFFER] = message.buffer
        read = content, self._same, self._places
        self._arguments = self._form, message.state, *read, self._found

    def take(self) -> TakenRow | TakenBytes | None:
        """Take a message; None if there is none.

        Raises:
            CspmError: rcl refuses.
        """
        end = kernel.take_row(*self._arguments, self._row)
        if end == kernel.NOTHING:
            return None
        if end != kernel.TAKEN:
            return self._other(end)
        stamp, number = self._found.tolist()
        return TakenRow(stamp, self._row.copy(), None if number == kernel.UNKNOWN else number)

    def take_due(self, stamp_ns: int, step_ns: int, number: int, most: int) -> TakenRows:
        """Take messages as long as they are due, at most 64.

        Args:
            stamp_ns: of the first one [ns].
            step_ns: from one stamp to the next [ns].
            number: that the first one's sender gave it.
            most: no more than so many.

        Raises:
            CspmError: rcl refuses.
        """
        self._due[:] = stamp_ns, number, step_ns
        count, end = kernel.take_rows(*self._arguments, self._due, self._rows[:most])
        ended = end in (kernel.TAKEN, kernel.NOTHING)
        return TakenRows(self._rows[:count], None if ended else self._other(end))

    def take_own(self, own: Words, times: Words, rows: Array) -> tuple[int, Tagged | None]:
        """Take messages as long as they are the next ones of one publisher.

        Args:
            own: its identity and its next number, (3,); moves on with them.
            times: takes their stamps and times of reception [ns], (most, 2).
            rows: takes their rows, (most, width).

        Returns:
            how many came so, and the message after them, if that is not as it should be.

        Raises:
            CspmError: rcl refuses.
        """
        count, end = kernel.take_own_rows(*self._arguments, own, times, rows)
        if end in (kernel.TAKEN, kernel.NOTHING):
            return count, None
        state = self._message.state
        gid = state[kernel.FOUND_GID : kernel.FOUND_GID + 2].tobytes()
        payload, number = self._other(end)
        return count, Tagged(payload, int(state[kernel.FOUND_RECEIVED]), number, gid)

    def _other(self, end: int) -> TakenBytes:
        """Return the message that lies in the buffer."""
        if end != kernel.STRANGE:
            clear_error()
            raise CspmError(f"{self._topic.name}: rcl takes no messages (its code {end})")
        message = self._message
        number = int(message.state[kernel.FOUND_NUMBER])
        if message.buffer != self._form[kernel.BUFFER]:
            self._find_buffer()
        return TakenBytes(message.content, None if number == kernel.UNKNOWN else number)

    def close(self) -> None:
        """Give back its memory; nothing can be taken then."""
        self._message.close()
