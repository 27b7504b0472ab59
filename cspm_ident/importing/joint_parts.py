"""Parts of a JointState that are missing: altogether, or in the first messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_series import ColumnSeries
from cspm_ident.importing.column_store import pieces
from cspm_ident.importing.import_plan import PlannedTopic

Array = NDArray[np.float64]


def without_empty_parts(
    planned: PlannedTopic, series: Mapping[str, ColumnSeries]
) -> tuple[PlannedTopic, tuple[str, ...]]:
    """Return a topic without the parts that have no number at all, and the names of those.

    A topic with nothing else is returned as it is.
    """
    parts = planned.topic.parts
    empty = tuple(part for part in parts if _is_empty(part, series))
    if not empty or len(empty) == len(parts):
        return planned, ()
    kept = tuple(part for part in parts if part not in empty)
    topic = replace(
        planned.topic,
        parts=kept,
        fields=tuple(f"{part}/{joint}" for part in kept for joint in planned.topic.joint_names),
    )
    fields = tuple(f for f in planned.fields if f.name.partition("/")[0] in kept)
    return PlannedTopic(topic, fields), empty


def _is_empty(part: str, series: Mapping[str, ColumnSeries]) -> bool:
    return all(
        _has_no_number(one.values) for name, one in series.items() if name.partition("/")[0] == part
    )


def _has_no_number(values: Array) -> bool:
    flat = np.atleast_1d(values)
    return all(bool(np.isnan(flat[piece]).all()) for piece in pieces(len(flat)))


def absent_numbers(
    values: Callable[[slice], Mapping[str, Array]], count: int, parts: tuple[str, ...]
) -> tuple[NDArray[np.bool_], dict[str, int]]:
    """Return which messages miss a number, and by part how many of the first have it not yet.

    The first messages may lack a part if they have another one, and if it comes later.

    Args:
        values: returns the values by field of a slice of the messages, each of shape (n,).
        count: number of messages.
        parts: of the topic.
    """
    begins = dict.fromkeys(parts, count)
    for piece in pieces(count):
        for part, gone in _missing_parts(values(piece), parts).items():
            if begins[part] == count and not gone.all():
                begins[part] = piece.start + int(np.argmin(gone))
    late = {part: 0 for part, begin in begins.items() if 0 < begin < count}
    absent = np.zeros(count, dtype=bool)
    for piece in pieces(count):
        columns = values(piece)
        missing = _missing_parts(columns, parts)
        nothing = np.all(list(missing.values()), axis=0)
        rows = np.arange(piece.start, piece.stop)
        excused = {part: (rows < begins[part]) & ~nothing for part in late}
        for name, column in columns.items():
            gone, first = np.isnan(column), excused.get(name.partition("/")[0])
            absent[piece] |= gone if first is None else gone & ~first
        late = {part: found + int(excused[part].sum()) for part, found in late.items()}
    return absent, {part: found for part, found in late.items() if found}


def _missing_parts(
    columns: Mapping[str, Array], parts: tuple[str, ...]
) -> dict[str, NDArray[np.bool_]]:
    """Return by part which messages have nothing of it, from values by field."""
    gone = {
        part: [np.isnan(v) for field, v in columns.items() if field.startswith(f"{part}/")]
        for part in parts
    }
    return {part: np.all(each, axis=0) for part, each in gone.items() if each}
