"""What sources without messages have in common: rows without stamps, no file held open."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from pathlib import Path

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.row_choice import Labels
from cspm_ident.importing.sources.source import Progress
from cspm_msgs_py.errors import InputError


class TableSource(ABC):
    """Base of the sources whose rows are no messages; see `Source`.

    Attributes:
        keys: columns that choose rows, set before reading; stored as numbers of their texts.
    """

    path: Path
    kind: str
    columns: tuple[str, ...]
    stamped = False

    def __init__(self, path: Path) -> None:
        """Take the path of the file."""
        self.path = path
        self.notes: list[str] = []
        self.time_units: dict[str, str] = {}
        self.keys: Mapping[str, Labels] = {}

    @abstractmethod
    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns; see `Source`."""

    def stamp_column(self, column: str, stamp: str) -> str:
        """Refuse: rows of a table have no stamps of their own.

        Raises:
            InputError: always.
        """
        raise InputError(f"{self.path}: stamp {stamp}, allowed: with bags; here column or rate")

    def close(self) -> None:  # noqa: B027 - most have nothing to close
        """Do nothing: no file is open between calls."""
