"""Several tables of one experiment, read as one: `cells:load` is column `load` of file `cells`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.source import Progress, Source
from cspm_msgs_py.errors import InputError


def file_of(column: str, files: Collection[str]) -> str:
    """Return the name of the file that a column is in; empty for the one that is imported."""
    name, mark, _ = column.partition(":")
    return name if mark and name in files else ""


class JoinedSource:
    """A table, and others beside it; see `Source`. Each keeps its rows and its instants."""

    stamped = False

    def __init__(self, first: Source, others: Mapping[str, Source]) -> None:
        """Take the file that is imported, and the others by their names in the mapping."""
        self._sources: dict[str, Source] = {"": first, **others}
        self.path = first.path
        self.kind = ", ".join([first.kind, *(f"{k}: {s.kind}" for k, s in others.items())])
        self.columns = tuple(
            in_file(name, column) for name, one in self._sources.items() for column in one.columns
        )
        self.notes: list[str] = []
        self.time_units: dict[str, str] = {}

    def stamp_column(self, column: str, stamp: str) -> str:
        """Refuse: rows of tables have no stamps of their own.

        Raises:
            InputError: always.
        """
        return self._sources[file_of(column, self._sources)].stamp_column(column, stamp)

    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns of all; see `Source`."""
        total = len(self._sources)
        for count, (name, source) in enumerate(self._sources.items()):
            own = {
                column.removeprefix(in_file(name, "")): column
                for column in (*numbers, *times)
                if file_of(column, self._sources) == name
            }
            if not own:
                raise InputError(
                    f"{source.path}: the mapping takes no column of it, allowed: at least one of"
                    f" {', '.join(in_file(name, each) for each in source.columns[:20])}"
                )
            source.read(
                [each for each, column in own.items() if column in numbers],
                {each: times[column] for each, column in own.items() if column in times},
                store.under(in_file(name, "")),
                partial(_onwards, progress, count, total),
            )
            self.time_units |= {in_file(name, k): unit for k, unit in source.time_units.items()}
            self.notes += [in_file(name, note) for note in source.notes]

    def close(self) -> None:
        """Let go of the files."""
        for source in self._sources.values():
            source.close()


def _onwards(progress: Progress, done: int, total: int, share: float) -> None:
    progress((done + share) / total)


def in_file(name: str, text: str) -> str:
    """Return the name of a column, or another text, of a file; `name` is empty for the first."""
    return f"{name}:{text}" if name else text
