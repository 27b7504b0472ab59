"""An import up to the point where it is written: read, converted, gathered, looked at."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.fingerprint import fingerprint
from cspm_ident.importing.import_plan import ImportPlan, PlannedTopic, plan_import
from cspm_ident.importing.mapping import MappingFile
from cspm_ident.importing.report import ImportReport, suspicions_of, topic_report
from cspm_ident.importing.sources.opening import open_source
from cspm_ident.importing.sources.source import Progress, Source
from cspm_ident.importing.time_base import Times, times_of
from cspm_ident.importing.topic_messages import ColumnSeries, TopicMessages, gather
from cspm_ident.importing.unwrapping import Unwrapped
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile


@dataclass(frozen=True)
class Prepared:
    """Messages by topic, in the order of the mapping, and what there is to say about them."""

    messages: dict[str, TopicMessages]
    report: ImportReport


def prepare(
    path: Path,
    mapping: MappingFile,
    testbed: TestbedFile,
    store: ColumnStore,
    progress: Progress,
    *,
    trial: bool,
) -> Prepared:
    """Return what an import of a file gives.

    Args:
        path: the file or folder.
        mapping: what its columns are.
        testbed: the machine.
        store: holds the columns as long as the messages are used.
        progress: called with the share of the file that was read.
        trial: nothing will be written: show also what the mapping refuses to write.

    Raises:
        InputError: naming what is wrong in the file or the mapping.
    """
    with closing(open_source(path, mapping)) as source:
        plan = plan_import(mapping, testbed.testbed, source)
        source.read(plan.numbers, plan.times, store, progress)
    times = _all_times(plan, store, mapping)
    origin = min(int(t.stamp_ns[t.known].min()) for t in times.values())
    messages, unwrapped = {}, {}
    for planned in plan.topics:
        name = planned.topic.name
        series, unwrapped[name] = _series(planned, times, store)
        where = f"{mapping.path}: channels.{name}"
        messages[name] = gather(planned, series, mapping.mapping, origin, where, trial=trial)
    raw = {name: store.column(name) for name in plan.numbers}
    reports = []
    for planned in plan.topics:
        name = planned.topic.name
        reports.append(topic_report(planned, messages[name], raw, unwrapped[name], origin))
    suspicions = suspicions_of(plan.topics, messages, unwrapped, testbed.testbed, origin)
    about, unused = _about(path, mapping, testbed), _unused(source, plan)
    report = ImportReport(about, source.kind, origin, source.notes, unused, reports, suspicions)
    return Prepared(messages, report)


def _about(path: Path, mapping: MappingFile, testbed: TestbedFile) -> dict[str, str]:
    return {
        "source": path.name,
        "source_sha256": fingerprint(path),
        "mapping": mapping.mapping.name,
        "mapping_sha256": mapping.sha256,
        "testbed": testbed.testbed.name,
        "testbed_sha256": testbed.sha256,
    }


def _unused(source: Source, plan: ImportPlan) -> list[str]:
    used = {*plan.numbers, *plan.times}
    if source.stamped:
        topics = {name.rpartition(":")[0] for name in used}
        return [name for name in source.columns if name.rpartition(":")[0] not in topics]
    return [name for name in source.columns if name not in used]


def _all_times(
    plan: ImportPlan, store: ColumnStore, mapping: MappingFile
) -> dict[tuple[str, str | None, int], Times]:
    """Return the stamps of each clock, by its name, its column and its number of rows."""
    found: dict[tuple[str, str | None, int], Times] = {}
    for topic in plan.topics:
        for field in topic.fields:
            if field.column is None:
                continue
            count = len(store.column(field.column))
            key = (field.clock, field.stamps, count)
            if key in found:
                continue
            where = f"{mapping.path}: clocks.{field.clock}"
            raw = None if field.stamps is None else store.column(field.stamps)
            if not count:
                raise InputError(f"{mapping.path}: column '{field.column}' has no rows")
            if raw is not None and len(raw) != count:
                raise InputError(
                    f"{where}: {len(raw)} times for {count} rows of column '{field.column}',"
                    " allowed: one each"
                )
            found[key] = times_of(raw, count, plan.clocks[field.clock], where)
    return found


def _series(
    planned: PlannedTopic, times: dict[tuple[str, str | None, int], Times], store: ColumnStore
) -> tuple[dict[str, ColumnSeries], dict[str, Unwrapped]]:
    """Return the columns of a topic in SI, and what unwrapping found."""
    series: dict[str, ColumnSeries] = {}
    unwrapped = {}
    for field in planned.fields:
        if field.conversion is None or field.column is None:
            series[field.name] = ColumnSeries(np.array(field.constant), None)
            continue
        raw = store.column(field.column)
        values, found = field.conversion.apply(np.asarray(raw))
        if found is not None:
            unwrapped[field.name] = found
        name = f"{planned.topic.name} {field.name}"
        store.append(name, values)
        series[field.name] = ColumnSeries(
            store.column(name), times[(field.clock, field.stamps, len(raw))]
        )
    return series, unwrapped
