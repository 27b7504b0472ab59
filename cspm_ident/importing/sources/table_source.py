"""What sources without messages have in common: rows without stamps, no file held open."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.row_choice import Labels, RowChoice, plain, row_choice
from cspm_ident.importing.sources.source import Progress, check_columns
from cspm_msgs_py.errors import InputError

_SHOWN = 20


class TableSource(ABC):
    """Base of the sources whose rows are no messages; see `Source`.

    Names with a choice, such as `q[drive=3]`, are those of some rows of a column.
    """

    kind: str
    columns: tuple[str, ...]
    stamped = False

    def __init__(self, path: Path) -> None:
        """Take the path of the file."""
        self.path = path
        self.notes: list[str] = []
        self.time_units: dict[str, str] = {}

    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns, whole or in part; see `Source`."""
        found = {name: row_choice(name, self.columns) for name in (*numbers, *times)}
        choices = {name: choice for name, choice in found.items() if choice is not None}
        whole = {name: choice.column if choice else name for name, choice in found.items()}
        keys = {choice.key: Labels() for choice in choices.values()}
        units = {whole[name]: unit for name, unit in times.items()}
        read = [whole[name] for name in numbers]
        wanted = check_columns(read, units, self.columns, self.path, keys)
        self._store(wanted, units, keys, store, progress)
        rows = {choice[1:]: self._chosen_rows(choice, keys, store) for choice in choices.values()}
        for name, choice in choices.items():
            store.append(name, store.column(choice.column)[rows[choice[1:]]])
            if choice.column in self.time_units:
                self.time_units[name] = self.time_units[choice.column]

    @abstractmethod
    def _store(
        self,
        wanted: list[str],
        times: Mapping[str, str | None],
        keys: Mapping[str, Labels],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store whole columns, those of `times` as times and those of `keys` as their labels."""

    def _chosen_rows(
        self, choice: RowChoice, keys: Mapping[str, Labels], store: ColumnStore
    ) -> NDArray[np.int64]:
        """Return the rows of a choice.

        Raises:
            InputError: there are none.
        """
        known = keys[choice.key].known
        wanted = plain(choice.value)
        if wanted not in known:
            more = f" and {len(known) - _SHOWN} more" if len(known) > _SHOWN else ""
            raise InputError(
                f"{self.path}: no row in which {choice.key} is {choice.value}, allowed:"
                f" {', '.join(known[:_SHOWN]) or 'none, there are no rows'}{more}"
            )
        return np.flatnonzero(store.column(choice.key) == known.index(wanted))

    def stamp_column(self, column: str, stamp: str) -> str:
        """Refuse: rows of a table have no stamps of their own.

        Raises:
            InputError: always.
        """
        raise InputError(f"{self.path}: stamp {stamp}, allowed: with bags; here column or rate")

    def close(self) -> None:  # noqa: B027 - most have nothing to close
        """Do nothing: no file is open between calls."""
