"""Parts of a JointState that are missing: altogether, or in the first messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_series import ColumnSeries
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
        bool(np.isnan(one.values).all())
        for name, one in series.items()
        if name.partition("/")[0] == part
    )


def not_yet_there(
    columns: Mapping[str, Array], parts: tuple[str, ...]
) -> dict[str, NDArray[np.bool_]]:
    """Return by part the first messages that have it not yet, though they have another part.

    A part that never comes is not among them.

    Args:
        columns: values by field, each of shape (n,).
        parts: of the topic.
    """
    missing = {
        part: np.all([np.isnan(v) for f, v in columns.items() if f.startswith(f"{part}/")], axis=0)
        for part in parts
    }
    leading = {part: np.logical_and.accumulate(gone) for part, gone in missing.items()}
    nothing = np.all(list(missing.values()), axis=0) if missing else np.zeros(0, dtype=bool)
    late = {part: first & ~nothing for part, first in leading.items() if not first.all()}
    return {part: first for part, first in late.items() if first.any()}
