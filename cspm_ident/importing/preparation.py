"""An import up to the point where it is written: read, converted, gathered, looked at."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from cspm_checks.clocks import refuse_two_clocks
from cspm_checks.pace import pace_of
from cspm_checks.suspicion import Suspicion
from cspm_checks.time_suspicions import is_beyond_devices
from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.fingerprint import fingerprint
from cspm_ident.importing.gathering import Gathered, gather_topics, stamps_of_clocks
from cspm_ident.importing.import_plan import ImportPlan, PlannedTopic, plan_import
from cspm_ident.importing.mapping import MappingFile
from cspm_ident.importing.report import ImportReport, topic_report
from cspm_ident.importing.sources.joined_source import file_of, in_file
from cspm_ident.importing.sources.opening import open_source
from cspm_ident.importing.sources.row_choice import row_choice
from cspm_ident.importing.sources.source import Progress, Source
from cspm_ident.importing.suspicions import suspicions_of
from cspm_ident.importing.topic_messages import TopicMessages
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed, TestbedFile


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
    times = stamps_of_clocks(plan, store, mapping, source.time_units)
    origin = min(each.first_ns for each in times.values())
    gathered = gather_topics(plan, times, store, mapping, origin, trial=trial)
    for planned in gathered.topics:
        messages = gathered.messages[planned.topic.name]
        _check_unit_of_time(planned, messages, plan, source, testbed.testbed, mapping)
    if not trial:
        refuse_two_clocks(gathered.messages, str(mapping.path))
    report = _report(path, mapping, testbed, source, plan, gathered, store, origin)
    return Prepared(gathered.messages, report)


def _report(
    path: Path,
    mapping: MappingFile,
    testbed: TestbedFile,
    source: Source,
    plan: ImportPlan,
    gathered: Gathered,
    store: ColumnStore,
    origin: int,
) -> ImportReport:
    raw = {name: store.column(name) for name in plan.numbers}
    reports = []
    for planned in gathered.topics:
        name = planned.topic.name
        columns = gathered.unwrapped[name]
        reports.append(topic_report(planned, gathered.messages[name], raw, columns, origin))
    suspicions = [
        Suspicion(where, "empty", "no number at all, left out") for where in gathered.empty
    ]
    found, unjudged = suspicions_of(gathered, testbed.testbed, origin)
    return ImportReport(
        _about(path, mapping, testbed),
        source.kind,
        origin,
        [*source.notes, *unjudged],
        _unused(source, plan, mapping.mapping.files),
        reports,
        suspicions + found,
    )


def _check_unit_of_time(
    planned: PlannedTopic,
    messages: TopicMessages,
    plan: ImportPlan,
    source: Source,
    testbed: Testbed,
    mapping: MappingFile,
) -> None:
    """Refuse numbers taken for s, without being asked, that no device can have sampled."""
    sensor = testbed.sensors.get(planned.topic.name)
    rate = pace_of(messages.stamp_ns, 0).rate_hz
    if not is_beyond_devices(rate, sensor.rate if sensor else None):
        return
    for field in planned.fields:
        clock = plan.clocks[field.clock] if field.clock else None
        if clock and clock.columns and clock.unit is None and not source.time_units:
            days = (rate or 0.0) / 86400.0
            raise InputError(
                f"{mapping.path}: clocks.{field.clock}.unit: missing, and in s {planned.topic.name}"
                f" comes at {rate:.6g} Hz, in days at {days:.6g} Hz, allowed: the unit of the"
                " column, such as datenum, excel, d, min"
            )


def _about(path: Path, mapping: MappingFile, testbed: TestbedFile) -> dict[str, str]:
    return {
        "source": path.name,
        "source_sha256": fingerprint(path),
        "mapping": mapping.mapping.name,
        "mapping_sha256": mapping.sha256,
        "testbed": testbed.testbed.name,
        "testbed_sha256": testbed.sha256,
        **_beside(mapping),
    }


def _beside(mapping: MappingFile) -> dict[str, str]:
    """Return the files beside the imported one, if any, with their SHA-256."""
    places = {name: mapping.path.parent / f.path for name, f in mapping.mapping.files.items()}
    found = [f"{name}: {place.name} {fingerprint(place)}" for name, place in places.items()]
    return {"files_sha256": ", ".join(found)} if found else {}


def _unused(source: Source, plan: ImportPlan, files: Collection[str]) -> list[str]:
    used = {*plan.numbers, *plan.times}
    choices = [row_choice(name, source.columns) for name in used]
    for choice in filter(None, choices):
        used |= {choice.column, in_file(file_of(choice.column, files), choice.key)}
    if source.stamped:
        topics = {name.rpartition(":")[0] for name in used}
        return [name for name in source.columns if name.rpartition(":")[0] not in topics]
    return [name for name in source.columns if name not in used]
