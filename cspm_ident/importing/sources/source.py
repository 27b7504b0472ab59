"""What an import needs of a file, whatever its kind."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Protocol

from cspm_ident.importing.column_store import ColumnStore
from cspm_msgs_py.errors import InputError

Progress = Callable[[float], None]
"""Takes the share of the work done, 0 to 1."""


class Source(Protocol):
    """A file with named columns.

    Attributes:
        path: the file or folder.
        kind: what it is, for people.
        columns: names of its columns, as far as they are known without reading the file.
        notes: what a person should know about how it was read.
        stamped: whether its rows are messages that bring their own stamps.
        time_units: units of columns of times that showed themselves while they were read.
    """

    path: Path
    kind: str
    columns: tuple[str, ...]
    notes: list[str]
    stamped: bool
    time_units: dict[str, str]

    def stamp_column(self, column: str, stamp: str) -> str:
        """Return the name of the column with the stamps, `header` or `log`, of another's rows."""

    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Put columns into a store under their names.

        Args:
            numbers: columns to be stored as float64, as longdouble where that would round whole
                numbers.
            times: columns to be stored with every digit, as longdouble, and their units where
                the mapping says them; texts are stored in ns.
            store: gets them.
            progress: called with the share that was read.

        Raises:
            InputError: a column is missing or holds other than numbers, or the file is damaged.
        """

    def close(self) -> None:
        """Let go of the file."""


def check_columns(
    numbers: Collection[str],
    times: Collection[str],
    columns: Collection[str],
    path: Path,
    keys: Collection[str] = (),
    shown: int = 40,
) -> list[str]:
    """Return the wanted columns, each once.

    Args:
        numbers: columns wanted as numbers.
        times: columns wanted as times.
        columns: those of the file.
        path: the file.
        keys: columns that choose rows.
        shown: how many an error names.

    Raises:
        InputError: the file has one of them not, or twice, or it is wanted as two things.
    """
    names = [*columns]
    for name in (wanted := list(dict.fromkeys([*numbers, *times, *keys]))):
        if name not in names:
            more = f" and {len(names) - shown} more" if len(names) > shown else ""
            raise InputError(
                f"{path}: no column '{name}', allowed: {', '.join(names[:shown])}{more}"
            )
        if names.count(name) > 1:
            raise InputError(f"{path}: column '{name}' occurs twice, allowed: each name once")
        if name in numbers and name in times:
            raise InputError(f"{path}: column '{name}' is clock and channel, allowed: one of both")
        if name in keys and (name in numbers or name in times):
            raise InputError(
                f"{path}: column '{name}' chooses rows and is read as well, allowed: one of both"
            )
    return wanted
