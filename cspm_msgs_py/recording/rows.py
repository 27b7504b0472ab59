"""The messages of one topic, collected from chunks and turned into stamps and rows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import Bytes, Layout, layout_of
from cspm_msgs_py.message import topic_of
from cspm_msgs_py.recording.chunk import Messages
from cspm_msgs_py.ros_types import deserialize, serialize
from cspm_msgs_py.topics import Topic

_BATCH = 8192


class Rows(NamedTuple):
    """The messages of one topic in order of log time.

    Attributes:
        log_ns: when each was recorded [ns], shape (n,).
        stamp_ns: when its values are valid [ns], shape (n,).
        rows: its numbers, shape (n, width).
    """

    log_ns: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    rows: NDArray[np.float64]

    def until(self, log_ns: int) -> Rows:
        """Return those recorded not later than a time [ns]."""
        end = int(np.searchsorted(self.log_ns, log_ns, side="right"))
        return Rows(self.log_ns[:end], self.stamp_ns[:end], self.rows[:end])


class RowCollector:
    """Decodes a topic's messages in batches.

    The first message gives frame and names. A message that has the same bytes but for stamp,
    numbers and padding is decoded by array operations, any other one by one; one that has other
    names or another frame is refused.
    """

    def __init__(self, name: str, ros_type: str, source: str) -> None:
        """Start with nothing.

        Args:
            name: topic name.
            ros_type: `package/msg/Type`.
            source: names the recording in errors.
        """
        self._name, self._ros_type, self._source = name, ros_type, source
        self._layout: Layout | None = None
        self._waiting: list[Bytes] = []
        self._logs: list[NDArray[np.int64]] = []
        self._stamps: list[NDArray[np.int64]] = []
        self._rows: list[NDArray[np.float64]] = []
        self._decoded = 0

    @property
    def topic(self) -> Topic | None:
        """The topic with its frame, names and columns; None before the first message."""
        return self._layout.topic if self._layout else None

    def add(self, messages: Messages) -> None:
        """Take the topic's messages of one chunk.

        Raises:
            InputError: bytes that are no message of the type, or of a type without a row.
        """
        if not len(messages):
            return
        self._logs.append(messages.logs)
        matrix = messages.payload_matrix()
        if matrix is None:
            payloads = list(messages.payloads())
            matrix = np.stack([self._canonical(p, i) for i, p in enumerate(payloads)])
        if self._waiting and self._waiting[0].shape[1] != matrix.shape[1]:
            self._decode()
        self._waiting.append(matrix)
        if len(self._waiting) * len(matrix) >= _BATCH:
            self._decode()

    def result(self) -> Rows:
        """Return all messages taken, ordered by log time.

        Raises:
            InputError: see `add`.
        """
        self._decode()
        width = self._layout.topic.width if self._layout else 0
        logs = np.concatenate([np.zeros(0, dtype=np.int64), *self._logs])
        stamps = np.concatenate([np.zeros(0, dtype=np.int64), *self._stamps])
        rows = np.concatenate([np.zeros((0, width)), *self._rows])
        if (np.diff(logs) < 0).any():
            order = np.argsort(logs, kind="stable")
            logs, stamps, rows = logs[order], stamps[order], rows[order]
        return Rows(logs, stamps, rows)

    def _decode(self) -> None:
        if not self._waiting:
            return
        matrix = np.concatenate(self._waiting)
        self._waiting = []
        layout = self._layout_from(matrix[0].tobytes())
        # Serialisers may add bytes at the end, which no reader looks at.
        fitting = matrix[:, : layout.size]
        if fitting.shape[1] == layout.size:
            odd = np.flatnonzero(~layout.matches(fitting))
            fitting = fitting.copy() if len(odd) else fitting
        else:
            odd = np.arange(len(matrix))
            fitting = np.empty((len(matrix), layout.size), dtype=np.uint8)
        for i in odd.tolist():
            fitting[i] = self._canonical(matrix[i].tobytes(), i)
        stamps, rows = layout.decode(fitting)
        self._stamps.append(stamps)
        self._rows.append(rows)
        self._decoded += len(matrix)

    def _layout_from(self, payload: bytes) -> Layout:
        if self._layout is None:
            try:
                message = deserialize(payload, self._ros_type)
                self._layout = layout_of(topic_of(self._name, message))
            except InputError as err:
                raise InputError(f"{self._source}: {self._name}: {err}") from None
        return self._layout

    def _canonical(self, payload: bytes, i: int) -> Bytes:
        """Return a payload as this project's serialiser writes the same message."""
        layout = self._layout_from(payload)
        where = f"{self._source}: message {self._decoded + i} of {self._name}"
        try:
            content = serialize(deserialize(payload, self._ros_type))
        except InputError as err:
            raise InputError(f"{where}: {err}") from None
        found = np.frombuffer(content, dtype=np.uint8)
        if len(found) != layout.size or not layout.matches(found[None])[0]:
            raise InputError(f"{where}: other names, lengths or frame than the first message")
        return found
