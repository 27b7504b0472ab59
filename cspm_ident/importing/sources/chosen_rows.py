"""A table with a line per drive, read as if each drive had columns of its own."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.row_choice import Labels, RowChoice, plain, row_choice
from cspm_ident.importing.sources.source import Progress
from cspm_ident.importing.sources.table_source import TableSource
from cspm_msgs_py.errors import InputError

_SHOWN = 20


class ChosenRows:
    """A table of which a mapping names rows as well; see `Source`.

    Names without a choice are those of whole columns.
    """

    stamped = False

    def __init__(self, table: TableSource) -> None:
        """Take the table."""
        self._table = table
        self.path: Path = table.path
        self.kind, self.columns = table.kind, table.columns
        self.notes, self.time_units = table.notes, table.time_units

    def stamp_column(self, column: str, stamp: str) -> str:
        """Refuse; see `TableSource`."""
        return self._table.stamp_column(column, stamp)

    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns, whole or in part; see `Source`."""
        chosen = {name: self._choice(name) for name in (*numbers, *times)}
        parts = {name: choice for name, choice in chosen.items() if choice is not None}
        self._table.keys = {choice.key: Labels() for choice in parts.values()}
        columns = {name: choice.column for name, choice in parts.items()}
        self._table.read(
            list(dict.fromkeys(columns.get(name, name) for name in numbers)),
            {columns.get(name, name): unit for name, unit in times.items()},
            store,
            progress,
        )
        self.time_units |= {
            name: self.time_units[column]
            for name, column in columns.items()
            if column in self.time_units
        }
        rows = {choice[1:]: self._rows(choice, store) for choice in parts.values()}
        for name, choice in parts.items():
            store.append(name, store.column(choice.column)[rows[choice[1:]]])

    def _choice(self, name: str) -> RowChoice | None:
        return None if name in self.columns else row_choice(name)

    def _rows(self, choice: RowChoice, store: ColumnStore) -> NDArray[np.int64]:
        """Return the rows of a choice.

        Raises:
            InputError: there are none.
        """
        known = self._table.keys[choice.key].known
        wanted = plain(choice.value)
        if wanted not in known:
            more = f" and {len(known) - _SHOWN} more" if len(known) > _SHOWN else ""
            raise InputError(
                f"{self.path}: no row in which {choice.key} is {choice.value}, allowed:"
                f" {', '.join(known[:_SHOWN]) or 'none, there are no rows'}{more}"
            )
        return np.flatnonzero(store.column(choice.key) == known.index(wanted))

    def close(self) -> None:
        """Let go of the file."""
        self._table.close()
