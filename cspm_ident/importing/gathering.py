"""From columns as they were read to the messages of each topic."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from cspm_ident.importing.column_series import ColumnSeries
from cspm_ident.importing.column_store import PIECE, ColumnStore, pieces, release
from cspm_ident.importing.import_plan import ImportPlan, PlannedField, PlannedTopic
from cspm_ident.importing.joint_parts import without_empty_parts
from cspm_ident.importing.mapping import Clock, MappingFile
from cspm_ident.importing.mending import Mended, mend
from cspm_ident.importing.time_base import (
    Times,
    set_stamps,
    single_precision,
    times_of,
    unlike_log,
)
from cspm_ident.importing.topic_messages import Index, SkippedMessages, TopicMessages, gather
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.errors import InputError

_Key = tuple[str, tuple[str, ...], int]


@dataclass(frozen=True)
class Gathered:
    """All topics of an import.

    Attributes:
        topics: as they are recorded, in the order of the mapping.
        messages: by topic.
        unwrapped: what made counters continuous, by topic and field.
        mended: what was changed, by topic and field.
        empty: topic and field of what was planned and has no number.
    """

    topics: list[PlannedTopic]
    messages: dict[str, TopicMessages]
    unwrapped: dict[str, dict[str, Unwrapper]]
    mended: dict[str, dict[str, Mended]]
    empty: list[str]


def gather_topics(
    plan: ImportPlan,
    times: dict[_Key, Times],
    store: ColumnStore,
    mapping: MappingFile,
    origin_ns: int,
    *,
    trial: bool,
) -> Gathered:
    """Return the messages of all topics.

    Args:
        plan: what to make.
        times: the stamps of each clock, see `stamps_of_clocks`.
        store: the columns; gets those in SI.
        mapping: what to do with what is missing, unpaired or out of order.
        origin_ns: the instant that segments count from [ns].
        trial: keep what is out of order, so that it can be shown.

    Raises:
        InputError: see `gather`.
    """
    found = Gathered([], {}, {}, {}, [])
    # What stands still has no clock of its own.
    for whole in sorted(plan.topics, key=lambda each: each.is_constant):
        name = whole.topic.name
        series = _series(whole, times, store, found)
        planned, empty = whole, tuple[str, ...]()
        if mapping.mapping.nan == "drop":
            planned, empty = without_empty_parts(whole, series)
        series = {field.name: series[field.name] for field in planned.fields}
        found.topics.append(planned)
        joints = whole.topic.joint_names
        found.empty.extend(f"{name} {part}/{joint}" for part in empty for joint in joints)
        where = f"{mapping.path}: channels.{name}"
        found.messages[name] = (
            _beside(planned, series, list(found.messages.values()))
            if whole.is_constant
            else gather(planned, series, mapping.mapping, origin_ns, where, trial=trial)
        )
    order = [each.topic.name for each in plan.topics]
    found.topics.sort(key=lambda each: order.index(each.topic.name))
    return found


def _beside(
    planned: PlannedTopic, series: dict[str, ColumnSeries], others: list[TopicMessages]
) -> TopicMessages:
    """Return a topic of constants, a message at each of those of another topic: a pose, if any."""
    poses = [each for each in others if "qw" in each.topic.fields]
    stamps = (poses or others)[0].stamp_ns
    places: dict[str, Index | None] = dict.fromkeys(series)
    return TopicMessages(planned.topic, stamps, series, places, SkippedMessages())


def stamps_of_clocks(
    plan: ImportPlan, store: ColumnStore, mapping: MappingFile, shown: dict[str, str]
) -> dict[_Key, Times]:
    """Return the stamps of each clock, by its name, its columns and its number of rows.

    Args:
        plan: what to make.
        store: the columns.
        mapping: for errors.
        shown: units that columns of times showed while they were read.

    Raises:
        InputError: there are no rows, not as many times as rows, or no time.
    """
    found: dict[_Key, Times] = {}
    said = plan.times
    for field in (field for topic in plan.topics for field in topic.fields):
        if field.column is None:
            continue
        count = len(store.column(field.column))
        key = (field.clock, field.stamps, count)
        if key not in found:
            units = [shown.get(name) or said[name] or "s" for name in field.stamps]
            times = _times(field, count, plan.clocks[field.clock], units, store, mapping)
            # Parts of a message have a clock each, and mostly one and the same.
            found[key] = next((other for other in found.values() if times.equals(other)), times)
            release(found[key].stamp_ns, found[key].rows)
    return found


def _times(
    field: PlannedField,
    count: int,
    clock: Clock,
    units: list[str],
    store: ColumnStore,
    mapping: MappingFile,
) -> Times:
    where = f"{mapping.path}: clocks.{field.clock}"
    if not count:
        raise InputError(f"{mapping.path}: column '{field.column}' has no rows")
    raw = [store.column(name) for name in field.stamps]
    if raw and len(raw[0]) != count:
        raise InputError(
            f"{where}: {len(raw[0])} times for {count} rows of column '{field.column}',"
            " allowed: one each"
        )
    unset, unlike = 0, 0.0
    if field.logged is not None:
        logged = store.column(field.logged)
        raw[0], unset = set_stamps(raw[0], logged, where)
        unlike = unlike_log(raw[0][:PIECE], logged[:PIECE]) if count > 1 else 0.0
    rounded = max(
        (single_precision(one, unit) for one, unit in zip(raw, units, strict=True)), default=0.0
    )
    times = times_of(raw, count, clock, units, store, where)
    return times._replace(unset=unset, rounded_s=rounded, unlike_log_s=unlike)


def _series(
    planned: PlannedTopic, times: dict[_Key, Times], store: ColumnStore, found: Gathered
) -> dict[str, ColumnSeries]:
    """Return the columns of a topic in SI; keep what unwrapping and mending found."""
    series: dict[str, ColumnSeries] = {}
    topic = planned.topic.name
    found.unwrapped[topic], found.mended[topic] = {}, {}
    for field in planned.fields:
        if field.conversion is None or field.column is None or field.source is None:
            series[field.name] = ColumnSeries(partial(np.array, field.constant), None)
            continue
        raw, unwrapper = store.column(field.column), field.conversion.unwrapper()
        clock = times[(field.clock, field.stamps, len(raw))]
        # Columns of a file may have any name but one that begins so.
        name = f"\0{topic} {field.name}"
        for part in pieces(len(raw), raw):
            store.append(name, field.conversion.apply(np.asarray(raw[part]), unwrapper))
        if unwrapper is not None:
            found.unwrapped[topic][field.name] = unwrapper
        if field.source.is_mended:
            values, mended = mend(store.column(name), clock, field.source)
            if mended is not None:
                found.mended[topic][field.name] = mended
                name = f"{name} mended"
                store.append(name, values)
        series[field.name] = ColumnSeries(partial(store.column, name), clock)
    return series
