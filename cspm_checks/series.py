"""What checks look at: the channels of a topic as columns, and one of them with its instants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
ALL = slice(None)


class TopicColumns(Protocol):
    """The messages of a topic in columns: from a file, a bag, or what a node heard last."""

    @property
    def topic(self) -> Topic:
        """What they are."""

    @property
    def stamp_ns(self) -> Stamps:
        """Shape (n,)."""

    @property
    def measured(self) -> tuple[str, ...]:
        """Fields that a sensor gave; of a pose these may be `roll`, `pitch`, `yaw`."""

    def values(self, field: str, chosen: slice = ALL) -> Array:
        """Return a field of the chosen messages, shape (n,) [SI], NaN where there is no number."""

    def rows(self, chosen: slice) -> Array:
        """Return the chosen messages, shape (n, width), in the order of the topic's fields."""

    def only(self, chosen: slice) -> Self:
        """Return some of the messages."""

    def release(self) -> None:
        """Let what was read leave memory, where it can be read again."""


Log = Mapping[str, TopicColumns]
"""All topics of a recording, by name."""


class SensorSeries(NamedTuple):
    """A channel without NaN: instants [s] and values [SI], both shape (n,)."""

    time: Array
    values: Array


def series_of(topic: TopicColumns, field: str, origin_ns: int) -> SensorSeries:
    """Return a field of a topic in order of time, without NaN; times from the origin [ns]."""
    values, stamps = topic.values(field), topic.stamp_ns
    if (np.diff(stamps) < 0).any():
        order = np.argsort(stamps, kind="stable")
        values, stamps = values[order], stamps[order]
    known = ~np.isnan(values)
    time = np.asarray((stamps[known] - origin_ns) * 1e-9, dtype=np.float64)
    return SensorSeries(time, values[known])
