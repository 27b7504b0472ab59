"""What sources with columns in memory have in common: numbers and times by name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.exact_numbers import exact_numbers, spacing_of
from cspm_ident.importing.sources.row_choice import Labels
from cspm_ident.importing.sources.source import Progress
from cspm_ident.importing.sources.table_source import TableSource
from cspm_ident.importing.sources.time_cells import TimeCells
from cspm_ident.importing.time_text import ISO_TIME
from cspm_msgs_py.errors import InputError

Vector = NDArray[Any]
LARGEST_SIDE = 64
"""More columns of one array than that are no signals of a log."""


class LoadedTable(TableSource):
    """Base of sources that hold their columns as arrays; see `Source`.

    Columns are numbers, dates of numpy (`datetime64`), or texts.
    """

    columns: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        """Begin without columns; `_vectors` gets them."""
        super().__init__(path)
        self._vectors: dict[str, Vector] = {}

    def _vector(self, name: str) -> Vector:
        """Return a column, shape (n,)."""
        return self._vectors[name]

    def _store(
        self,
        wanted: list[str],
        times: Mapping[str, str | None],
        keys: Mapping[str, Labels],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        for count, name in enumerate(wanted, start=1):
            vector = self._vector(name)
            if name in keys:
                found: Vector = keys[name].read(vector.astype(str))
            elif name in times:
                found = self._times(name, vector, times[name])
            else:
                found = self._numbers(name, vector)
            store.append(name, found)
            if vector.dtype == np.float64 and (step := spacing_of(vector)) > 1.0:
                self.notes.append(
                    f"column '{name}' holds whole numbers from 2⁵³ on in double precision, which"
                    f" rounds them to {step:.0f}; stored as 64-bit integers they are exact"
                )
            progress(count / len(wanted))

    def _numbers(self, name: str, vector: Vector) -> NDArray[Any]:
        if vector.dtype.kind in "biuf":
            return exact_numbers(vector)
        raise InputError(
            f"{self.path}: column '{name}' holds {_kind(vector)}, allowed: numbers; dates and texts"
            " as the column of a clock"
        )

    def _times(self, name: str, vector: Vector, unit: str | None) -> Vector:
        if vector.dtype.kind == "M":
            if unit not in (None, ISO_TIME):
                raise InputError(
                    f"{self.path}: column '{name}' holds dates, unit {unit}, allowed: {ISO_TIME}"
                )
            self.time_units[name] = ISO_TIME
            ns = vector.astype("datetime64[ns]")
            whole = ns.astype(np.int64).astype(np.longdouble)
            return np.where(np.isnat(ns), np.longdouble("nan"), whole)
        if vector.dtype.kind == "m":
            if unit not in (None, "ns"):
                raise InputError(
                    f"{self.path}: column '{name}' holds durations, unit {unit}, allowed: ns"
                )
            self.time_units[name] = "ns"
            spans = vector.astype("timedelta64[ns]")
            counts = spans.astype(np.int64).astype(np.longdouble)
            return np.where(np.isnat(spans), np.longdouble("nan"), counts)
        if vector.dtype.kind in "biuf":
            cells = TimeCells(self.path, name, unit)
            if cells.textual:
                raise InputError(
                    f"{self.path}: column '{name}' holds numbers, unit {unit}, allowed: a unit of"
                    " numbers, such as s"
                )
            return vector.astype(np.longdouble)
        cells = TimeCells(self.path, name, unit)
        found = cells.read(np.array([str(cell) for cell in vector]), lambda row: row + 1)
        if cells.unit is not None:
            self.time_units[name] = cells.unit
        return found


def _kind(vector: Vector) -> str:
    return {"M": "dates", "m": "durations", "c": "complex numbers"}.get(vector.dtype.kind, "texts")


def signals(name: str, value: NDArray[Any]) -> list[tuple[str, Vector]]:
    """Return the vectors of an array of numbers as `name[i]`, `name[i,j]`.

    Time is its longest axis, the first of several. An array of one dimension is one vector. Other
    axes of more than 64 elements make no signals.
    """
    if value.ndim == 1:
        return [(name, value)]
    time = int(np.argmax(value.shape))
    rest = [side for axis, side in enumerate(value.shape) if axis != time]
    if max(rest, default=0) > LARGEST_SIDE or value.ndim == 0:
        return []
    moved = np.moveaxis(value, time, -1)
    return [
        (f"{name}[{','.join(map(str, place))}]", moved[place])
        for place in np.ndindex(*moved.shape[:-1])
    ]
