"""A recording while it is being made."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cspm.signals import Signals
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording as Reader
from cspm_msgs_py.recording import Rows
from cspm_msgs_py.topics import Topic

# What a viewer shows.
SHOWN = (
    *("/bar/pose", "/bar/reference", "/winch_frame/pose", "/target/pose"),
    *("/winches/state", "/cables/tension"),
)


class GrowingRecording(Signals):
    """The shown signals of a recording that another thread or program goes on writing."""

    def __init__(self, folder: Path) -> None:
        """Watch the recording in a folder, which need not be there yet."""
        self._folder = folder
        self._topic: dict[str, Topic] = {}
        self._rows: dict[str, Rows] = {}
        self._begin_ns = self._chunks = 0

    def update(self) -> bool:
        """Read what came since the last time; return whether anything did.

        Raises:
            InputError: there is nothing to read yet.
        """
        with Reader(self._folder) as reader:
            if reader.chunks == self._chunks:
                return False
            names = [name for name in SHOWN if _has_rows(reader, name)]
            for name in names:
                if name not in self._topic:
                    self._topic[name] = reader.topic(name)
            # A topic that came later was in no chunk that is left out.
            fresh = reader.rows_of(names, after=self._chunks)
            self._chunks, self._begin_ns = reader.chunks, reader.start_ns
        for name, rows in fresh.items():
            known = self._rows.get(name)
            self._rows[name] = rows if known is None else _joined(known, rows)
        return True

    def _topics(self) -> tuple[str, ...]:
        return tuple(name for name, rows in self._rows.items() if len(rows.log_ns))

    def _read(self, name: str) -> tuple[Topic, Rows]:
        return self._topic[name], self._rows[name]

    def _start_ns(self) -> int:
        return self._begin_ns

    @property
    def _label(self) -> str:
        return str(self._folder)


def _has_rows(reader: Reader, name: str) -> bool:
    about = reader.topics.get(name)
    return about is not None and about.count > 0 and carries_row(about.ros_type)


def _joined(known: Rows, fresh: Rows) -> Rows:
    return Rows(*(np.concatenate(pair) for pair in zip(known, fresh, strict=True)))
