"""The messages of one topic: which samples stand together at one instant, and which are left out.

No sample is moved in time and none is made; see `pairing`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cspm_checks.disorder import order_of
from cspm_ident.importing.column_series import ColumnSeries
from cspm_ident.importing.column_store import release
from cspm_ident.importing.import_plan import ANGLES, PlannedTopic
from cspm_ident.importing.joint_parts import absent_numbers
from cspm_ident.importing.mapping import Mapping, Segment
from cspm_ident.importing.pairing import Tolerance, paired
from cspm_ident.importing.time_base import out_of_order
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
Index = NDArray[np.int64]
_QUATERNION = ("qx", "qy", "qz", "qw")


@dataclass(frozen=True)
class SkippedMessages:
    """How many messages were not made, and why."""

    no_time: int = 0
    unpaired: int = 0
    missing: int = 0
    disorder: int = 0
    segments: tuple[int, ...] = ()

    @property
    def total(self) -> int:
        """Samples or messages left out in all."""
        return self.no_time + self.unpaired + self.missing + self.disorder + sum(self.segments)


@dataclass(frozen=True)
class TopicMessages:
    """The messages of a topic as stamps and places in columns.

    Attributes:
        topic: what they are.
        stamp_ns: shape (n,).
        series: the columns by field, in the order of the mapping.
        places: for each field the row of each message, shape (n,); None for a constant.
        left_out: what became no message.
        tolerance: how far stamps of one message differ; None where they are equal.
        late_parts: how many of the first messages lack a part, by part.
    """

    topic: Topic
    stamp_ns: Index
    series: dict[str, ColumnSeries]
    places: dict[str, Index | None]
    left_out: SkippedMessages
    tolerance: Tolerance | None = None
    late_parts: dict[str, int] = field(default_factory=dict)

    @property
    def measured(self) -> tuple[str, ...]:
        """Fields that columns gave, not constants."""
        return tuple(name for name, at in self.places.items() if at is not None)

    def only(self, chosen: slice | NDArray[np.bool_]) -> TopicMessages:
        """Return some of the messages."""
        # Fields of one clock share their rows, which may be many.
        rows = {id(at): at[chosen] for at in self.places.values() if at is not None}
        places = {name: None if at is None else rows[id(at)] for name, at in self.places.items()}
        return replace(self, stamp_ns=self.stamp_ns[chosen], places=places)

    def release(self) -> None:
        """Let what was read of stamps and rows leave memory."""
        release(self.stamp_ns, *(at for at in self.places.values() if at is not None))

    def values(self, field: str, chosen: slice = slice(None)) -> Array:
        """Return a field of the chosen messages, shape (n,) [SI]."""
        places = self.places[field]
        if places is None:
            return np.full(len(self.stamp_ns[chosen]), float(self.series[field].values))
        return np.asarray(self.series[field].values[places[chosen]])

    def rows(self, chosen: slice) -> Array:
        """Return the rows of the chosen messages, shape (n, width)."""
        columns: dict[str, Array] = {name: self.values(name, chosen) for name in self.series}
        if "roll" in columns:
            angles = np.stack([columns[name] for name in ANGLES[::-1]], axis=1)
            turned = Rotation.from_euler("ZYX", angles).as_quat()
            columns |= dict(zip(_QUATERNION, turned.T, strict=True))
        return np.stack([columns[name] for name in self.topic.fields], axis=1)


def gather(
    planned: PlannedTopic,
    series: dict[str, ColumnSeries],
    mapping: Mapping,
    origin_ns: int,
    where: str,
    *,
    trial: bool,
) -> TopicMessages:
    """Return the messages of a topic.

    Args:
        planned: the topic.
        series: its columns by field.
        mapping: what to do with what is missing, unpaired or out of order.
        origin_ns: the instant that segments count from [ns].
        where: names the topic in errors.
        trial: keep what is out of order, so that it can be shown.

    Raises:
        InputError: numbers of one message never stand together, or the mapping refuses what it
            finds.
    """
    pairs = paired(series, mapping, where)
    stamps, places = pairs.stamp_ns, pairs.places
    left: dict[str, Any] = {"no_time": pairs.no_time, "unpaired": pairs.unpaired}
    keep = np.ones(len(stamps), dtype=bool)
    dropped = []
    for segment in mapping.drop:
        hit = keep & _inside(segment, planned.topic.name, stamps, origin_ns)
        dropped.append(int(hit.sum()))
        keep &= ~hit
    left["segments"] = tuple(dropped)
    measured = {name: at for name, at in places.items() if at is not None}

    def values(piece: slice) -> dict[str, Array]:
        return {name: series[name].values[at[piece]] for name, at in measured.items()}

    absent, late = absent_numbers(values, len(stamps), planned.topic.parts)
    keep, left["missing"] = _complete(stamps, keep, absent, mapping, where, origin_ns)
    keep, left["disorder"] = _in_order(stamps, keep, series, where, origin_ns, trial=trial)
    if not keep.any():
        raise InputError(f"{where}: no message is left, allowed: at least one")
    skipped = SkippedMessages(**left)
    found = TopicMessages(planned.topic, stamps, series, places, skipped, pairs.tolerance, late)
    return found if keep.all() else found.only(keep)


def _inside(segment: Segment, topic: str, stamps: Index, origin_ns: int) -> NDArray[np.bool_]:
    if segment.topics and topic not in segment.topics:
        return np.zeros(len(stamps), dtype=bool)
    since = (stamps - origin_ns) * 1e-9
    return np.asarray((since >= segment.start) & (since <= segment.end))


def _complete(
    stamps: Index,
    keep: NDArray[np.bool_],
    absent: NDArray[np.bool_],
    mapping: Mapping,
    where: str,
    origin_ns: int,
) -> tuple[NDArray[np.bool_], int]:
    """Return what to keep, and how many messages went because a number is missing."""
    absent = keep & absent
    count = int(absent.sum())
    if mapping.nan == "keep" or not count:
        return keep, 0
    if mapping.nan == "refuse":
        at = (int(stamps[absent][0]) - origin_ns) * 1e-9
        raise InputError(
            f"{where}: {count} messages with a number missing, the first at {at:.9g} s, allowed:"
            " none, with nan: refuse"
        )
    return keep & ~absent, count


def _in_order(
    stamps: Index,
    keep: NDArray[np.bool_],
    series: dict[str, ColumnSeries],
    where: str,
    origin_ns: int,
    *,
    trial: bool,
) -> tuple[NDArray[np.bool_], int]:
    """Return what to keep, and how many messages went because their stamps are out of order."""
    late = out_of_order(stamps, keep)
    policies = {one.times.disorder for one in series.values() if one.times is not None}
    if not len(late) or policies == {"keep"}:
        return keep, 0
    if "refuse" in policies:
        if trial:
            return keep, 0
        at, order = (int(stamps[late[0]]) - origin_ns) * 1e-9, order_of(stamps[keep])
        raise InputError(
            f"{where}: {len(late)} stamps not later than one before, the first of message"
            f" {late[0] + 1} at {at:.9g} s, allowed: rising stamps, {order.remedy},"
            " or disorder: keep"
        )
    keep = keep.copy()
    keep[late] = False
    return keep, len(late)
