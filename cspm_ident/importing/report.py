"""What an import amounts to, before it is done."""

from __future__ import annotations

import math
from collections.abc import Mapping as MappingOf
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from cspm_checks.pace import Pace, pace_of
from cspm_checks.suspicion import Suspicion
from cspm_checks.value_suspicions import resolution
from cspm_ident.importing.field_statistics import statistics_of
from cspm_ident.importing.import_plan import PlannedField, PlannedTopic
from cspm_ident.importing.topic_messages import SkippedMessages, TopicMessages
from cspm_ident.importing.unwrapping import Unwrapper

FIRST_ROWS = 5


@dataclass(frozen=True)
class FieldReport:
    """One channel.

    Attributes:
        field: of the message.
        source: column, or `constant`.
        quantity: SI unit.
        formula: the conversion.
        raw: the first messages' raw numbers; empty for a constant.
        converted: the same in SI.
        low: least value [SI].
        high: largest value [SI].
        mean: mean value [SI].
        deviation: standard deviation [SI].
        resolution: step of its values [SI], None where there is none.
        turns: how often a counter passed its end.
    """

    field: str
    source: str
    quantity: str
    formula: str
    raw: list[float]
    converted: list[float]
    low: float
    high: float
    mean: float
    deviation: float
    resolution: float | None
    turns: int


@dataclass(frozen=True)
class TopicReport:
    """One topic: its stamps, its channels, what became no message; first stamps from the origin."""

    topic: str
    pace: Pace
    first_s: list[float]
    fields: list[FieldReport]
    left_out: SkippedMessages


@dataclass(frozen=True)
class ImportReport:
    """All of it.

    Attributes:
        about: source, mapping and test-bed with their SHA-256.
        kind: what the source is.
        origin_ns: the first stamp of all; times in the report count from it [ns].
        notes: how the source was read.
        unused: columns of the source that the mapping leaves out.
        topics: in the order of the mapping.
        suspicions: what looks wrong.
    """

    about: dict[str, str]
    kind: str
    origin_ns: int
    notes: list[str]
    unused: list[str]
    topics: list[TopicReport]
    suspicions: list[Suspicion]

    def data(self) -> dict[str, Any]:
        """Return it as plain data; numbers that do not exist are None."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain


def _plain(node: Any) -> Any:  # noqa: ANN401 - any nested data
    if isinstance(node, dict):
        return {key: _plain(inner) for key, inner in node.items()}
    if isinstance(node, list | tuple):
        return [_plain(inner) for inner in node]
    if isinstance(node, np.generic):
        node = node.item()
    return None if isinstance(node, float) and not math.isfinite(node) else node


def topic_report(
    planned: PlannedTopic,
    messages: TopicMessages,
    raw: MappingOf[str, Any],
    unwrapped: MappingOf[str, Unwrapper],
    origin_ns: int,
) -> TopicReport:
    """Return what becomes of a topic.

    Args:
        planned: the topic.
        messages: its messages.
        raw: columns as they were read, by name.
        unwrapped: what made counters continuous, by field.
        origin_ns: times count from it [ns].
    """
    fields = []
    for field in planned.fields:
        places = messages.places[field.name]
        rows = np.zeros(0) if places is None else raw[field.column or ""][places[:FIRST_ROWS]]
        found = statistics_of(partial(messages.values, field.name), len(messages.stamp_ns))
        fields.append(
            FieldReport(
                field=field.name,
                source=field.column or "constant",
                quantity=field.conversion.quantity if field.conversion else "",
                formula=field.conversion.formula if field.conversion else _constant(field),
                raw=rows.astype(np.float64).tolist(),
                converted=messages.values(field.name, slice(FIRST_ROWS)).tolist(),
                low=found.low,
                high=found.high,
                mean=found.mean,
                deviation=found.deviation,
                resolution=resolution(found.head) if field.conversion else None,
                turns=unwrapped[field.name].turns if field.name in unwrapped else 0,
            )
        )
    messages.release()
    stamps = messages.stamp_ns
    first_s = ((stamps[:FIRST_ROWS] - origin_ns) * 1e-9).tolist()
    pace = pace_of(stamps, origin_ns)
    return TopicReport(planned.topic.name, pace, first_s, fields, messages.left_out)


def _constant(field: PlannedField) -> str:
    return "not measured" if field.is_unmeasured else f"{field.constant:g}"
