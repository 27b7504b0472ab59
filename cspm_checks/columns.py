"""The messages of a topic as an array in memory: of a recording, or of what a node heard last."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from cspm_checks.series import ALL, Stamps
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Columns:
    """Messages as rows.

    Attributes:
        topic: what they are.
        stamp_ns: shape (n,).
        table: shape (n, width) [SI].
    """

    topic: Topic
    stamp_ns: Stamps
    table: Array

    @property
    def measured(self) -> tuple[str, ...]:
        """Fields with a number."""
        known = np.flatnonzero(~np.isnan(self.table).all(axis=0))
        return tuple(self.topic.fields[i] for i in known)

    def values(self, field: str, chosen: slice = ALL) -> Array:
        """Return a field of the chosen messages, shape (n,) [SI]."""
        return self.table[chosen, self.topic.fields.index(field)]

    def rows(self, chosen: slice) -> Array:
        """Return the chosen messages, shape (n, width)."""
        return self.table[chosen]

    def only(self, chosen: slice) -> Self:
        """Return some of the messages."""
        return replace(self, stamp_ns=self.stamp_ns[chosen], table=self.table[chosen])

    def release(self) -> None:
        """Keep it: it is read from nowhere else."""


def recorded_columns(recording: Recording) -> dict[str, Columns]:
    """Return what sensors gave in a recording, by topic, in the order of the contract."""
    found = {}
    for name in MEASURED:
        if name in recording.topics and recording.topics[name].count:
            rows = recording.rows(name)
            found[name] = Columns(recording.topic(name), rows.stamp_ns, rows.rows)
    return found
