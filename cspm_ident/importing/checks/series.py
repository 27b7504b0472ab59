"""A channel as instants and values, for checks that compare channels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.topic_messages import TopicMessages

Array = NDArray[np.float64]


class SensorSeries(NamedTuple):
    """A channel without NaN: instants [s] and values [SI], both shape (n,)."""

    time: Array
    values: Array


def series_of(topic: TopicMessages, field: str, origin_ns: int) -> SensorSeries:
    """Return a field of a topic in order of time, without NaN; times from the origin [ns]."""
    values = topic.values(field)
    order = np.argsort(topic.stamp_ns, kind="stable")
    order = order[~np.isnan(values[order])]
    time = np.asarray((topic.stamp_ns[order] - origin_ns) * 1e-9, dtype=np.float64)
    return SensorSeries(time, values[order])
