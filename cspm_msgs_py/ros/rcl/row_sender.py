"""A topic's rows written and handed to the middleware in compiled code."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rclpy.publisher import Publisher

from cspm_msgs_py.layout import LATEST_SECOND, layout_of
from cspm_msgs_py.message import NANOSECONDS
from cspm_msgs_py.ros.rcl.rcl_message import RclMessage, clear_error
from cspm_msgs_py.ros.rcl.send_kernel import (
    FORM,
    MESSAGE,
    PUBLISH,
    PUBLISHER,
    SECONDS,
    SENT,
    SIGNATURE,
    send_row,
)
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireWriter

Array = NDArray[np.float64]
# A ROS stamp holds instants before this one [ns].
_LATEST = (LATEST_SECOND + 1) * NANOSECONDS


class RowSender:
    """Sends the messages of one publisher: the same bytes as `WireWriter`'s. From one thread."""

    def __init__(self, topic: Topic, publisher: Publisher, publish: int | None) -> None:
        """Prepare the bytes that all messages share.

        Args:
            topic: the topic.
            publisher: rclpy's.
            publish: address of `rcl_publish_serialized_message`; None sends by rclpy.

        Raises:
            InputError: the topic's type carries no row, or its columns do not fit its names.
        """
        layout = layout_of(topic)
        self._writer, self._row = WireWriter(topic), np.zeros(topic.width)
        # What `Publisher.publish` does with bytes, without its checks of each message.
        self._publish: Callable[[bytes], None] = publisher.handle.publish_raw
        self._message: RclMessage | None = None
        if publish is None:
            return
        # A run in real time has no time for it.
        send_row.compile(SIGNATURE)
        self._message = message = RclMessage(-(-layout.size // 8))
        content = message.room(-(-layout.size // 8)).view(np.uint32)
        message.fill(layout.template.tobytes())
        form = np.zeros(FORM, dtype=np.int64)
        form[PUBLISH], form[PUBLISHER] = publish, publisher.handle.pointer
        form[MESSAGE], form[SECONDS] = message.address, layout.seconds // 4
        self._arguments = form, content, layout.halves

    def send(self, stamp_ns: int, row: Array) -> None:
        """Send a row (width,) that is valid at an instant [ns].

        Raises:
            InputError: a stamp outside what a ROS stamp can hold, or a row of another shape.
        """
        numbers = np.asarray(row, dtype=np.float64)
        fits = numbers.shape == self._row.shape and 0 <= stamp_ns < _LATEST
        if self._message is not None and fits:
            self._row[:] = numbers
            if send_row(*self._arguments, stamp_ns, self._row) == SENT:
                return
            clear_error()
        self._publish(self._writer.encode(stamp_ns, row))

    def close(self) -> None:
        """Give back its memory; later rows are rclpy's to send or refuse."""
        if self._message is not None:
            message, self._message = self._message, None
            message.close()
