"""A text table, read in pieces."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TextIO, cast

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import CsvFormat
from cspm_ident.importing.sources.exact_numbers import may_be_rounded
from cspm_ident.importing.sources.number_text import is_number
from cspm_ident.importing.sources.row_choice import Labels
from cspm_ident.importing.sources.row_shape import RowShape
from cspm_ident.importing.sources.source import Progress
from cspm_ident.importing.sources.table_end import TableEnd
from cspm_ident.importing.sources.table_head import table_head
from cspm_ident.importing.sources.table_source import TableSource
from cspm_ident.importing.sources.text_encoding import encoding_of
from cspm_ident.importing.sources.time_cells import TimeCells
from cspm_msgs_py.errors import InputError

PIECE = 1 << 23  # characters read at once
_TIME_CELL = 40  # characters
_PACKED = 4  # times shorter, for the progress shown
Lines = list[str]
Table = NDArray[Any]


class CsvSource(TableSource):
    """A text table with a column per quantity; see `Source`."""

    kind = "text table"

    def __init__(
        self, path: Path, form: CsvFormat, mapping_path: str, *, packed: bool = False
    ) -> None:
        """Read the names of the columns.

        Args:
            path: the table.
            form: how it is written.
            mapping_path: of the mapping, for errors.
            packed: the table is compressed by gzip.

        Raises:
            InputError: the file has no such line, or is no text in this encoding.
        """
        super().__init__(path)
        self._form, self._packed = form, packed
        self._encoding = encoding_of(path, form, packed=packed)
        try:
            with self._open() as file:
                head = table_head(file, form, path)
        except UnicodeDecodeError as err:
            raise InputError(_undecodable(path, err)) from None
        self._first, self._delimiter = head.first, head.delimiter
        self.notes += head.notes
        if form.decimal == "," and self._delimiter == ",":
            raise InputError(f"{mapping_path}: csv.delimiter: ',' is the decimal mark as well")
        numbered = tuple(str(i + 1) for i in range(len(head.cells)))
        self.columns = form.names or (tuple(head.cells) if form.names_line else numbered)
        self._width = len(self.columns)
        self._rows = RowShape(path, self.columns, self._delimiter, form)
        self._ends = TableEnd(self._rows, self._width, self.notes)

    def _store(
        self,
        wanted: list[str],
        times: Mapping[str, str | None],
        keys: Mapping[str, Labels],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        places = {self.columns.index(name): name for name in wanted}
        clocks: dict[int, TimeCells | Labels] = {
            place: keys.get(name) or TimeCells(self.path, name, times[name])
            for place, name in places.items()
            if name in keys or name in times
        }
        total, done = self.path.stat().st_size, 0
        total *= _PACKED if self._packed else 1
        with self._open() as file:
            for line, lines in self._pieces(file):
                table = self._parse(lines, line, sorted(places), clocks)
                for place, name in places.items():
                    piece = table[str(place)]
                    if place in clocks:
                        piece = clocks[place].read(piece, partial(self._line_of, lines, line))
                    store.append(name, piece)
                done += sum(map(len, lines))
                progress(min(done / total, 1.0))
        progress(1.0)
        self._conclude(clocks)

    def _conclude(self, clocks: Mapping[int, TimeCells | Labels]) -> None:
        for place, clock in clocks.items():
            if clock.unit is not None:
                self.time_units[self.columns[place]] = clock.unit
        if self._rows.trailing:
            self.notes.append(f"{self._rows.trailing} rows end with empty cells, left out")

    def _line_of(self, lines: Lines, line: int, row: int) -> int:
        """Return the number of the line that holds a row of a piece."""
        full = [i for i, text in enumerate(lines) if not self._rows.is_void(text)]
        return line + full[row]

    def _open(self) -> TextIO:
        if self._packed:
            return cast("TextIO", gzip.open(self.path, "rt", encoding=self._encoding))
        return self.path.open(encoding=self._encoding, newline=None)

    def _cells(self, line: str) -> list[str]:
        if self._delimiter is None:
            return line.split()
        return next(csv.reader([line.rstrip("\n")], delimiter=self._delimiter), [])

    def _pieces(self, file: TextIO) -> Iterator[tuple[int, Lines]]:
        """Yield lines of numbers in pieces, each with the number of its first line."""
        line = 1
        try:
            for _ in range(self._first - 1):
                file.readline()
                line += 1
            lines = file.readlines(PIECE)
            while lines:
                after = file.readlines(PIECE)
                following = line + len(lines)
                lines = self._ends.plain(lines, line)
                if not after:
                    lines = self._ends.without_end(lines, line)
                if lines:
                    yield line, lines
                line, lines = following, after
        except UnicodeDecodeError as err:
            raise InputError(_undecodable(self.path, err)) from None
        except (EOFError, zlib.error, gzip.BadGzipFile) as err:
            raise InputError(f"{self.path}: damaged gzip data ({err})") from None

    def _parse(
        self, lines: Lines, line: int, places: list[int], clocks: Mapping[int, TimeCells | Labels]
    ) -> Table:
        exact = set(clocks)
        kind = np.dtype([(str(p), f"U{_TIME_CELL}" if p in exact else "f8") for p in places])
        numeric = [p for p in places if p not in clocks or not clocks[p].textual]
        text = self._rows.plain_numbers(self._rows.check_widths(lines, line), line, numeric)
        try:
            table = self._load(text, kind, places)
        except ValueError:
            text = [self._filled(row) for row in text]
            table = self._load_or_blame(text, kind, places, line, exact)
        long = {p for p in places if p not in exact and may_be_rounded(table[str(p)])}
        if long:
            kind = np.dtype([(n, "g" if int(n) in long else kind[n]) for n in kind.names or ()])
            table = self._load(text, kind, places)
        # An open quote swallows lines in silence.
        if any('"' in row for row in lines):
            rows = sum(not self._rows.is_void(row) for row in lines)
            if rows != len(table):
                raise InputError(self._quoted(line, lines))
        return table

    def _load_or_blame(
        self, text: Lines, kind: np.dtype[Any], places: list[int], line: int, exact: set[int]
    ) -> Table:
        try:
            return self._load(text, kind, places)
        except ValueError:
            self._blame(text, line, places, exact)
        raise InputError(self._quoted(line, text))

    def _quoted(self, line: int, lines: Lines) -> str:
        first = next((i for i, row in enumerate(lines) if row.count('"') % 2), 0)
        return f"{self.path}: line {line + first}: a quote is left open, allowed: one line per row"

    def _load(self, lines: Lines, kind: np.dtype[Any], places: list[int]) -> Table:
        if all(self._rows.is_void(row) for row in lines):
            return np.zeros(0, dtype=kind)
        return np.loadtxt(
            lines,
            dtype=kind,
            delimiter=self._delimiter,
            usecols=places,
            comments=self._form.comment or None,
            quotechar='"',
            ndmin=1,
        )

    def _filled(self, row: str) -> str:
        """Return a line with `nan` where there is no number."""
        if self._delimiter is None or not row.strip():
            return row
        mark = re.escape(self._delimiter)
        words = "|".join(map(re.escape, self._form.missing))
        empty = rf"(?:[^\S{mark}\n]*(?:{words})?[^\S{mark}\n]*)"
        return re.sub(rf"(^|(?<={mark})){empty}(?={mark}|\n|$)", "nan", row)

    def _blame(self, lines: Lines, line: int, places: list[int], exact: set[int]) -> None:
        """Refuse the first cell of these lines that is no number."""
        for number, row in enumerate(lines, start=line):
            if self._rows.is_void(row):
                continue
            cells = self._cells(self._rows.content(row))
            for place in places:
                where = f"{self.path}: line {number}, column '{self.columns[place]}'"
                if place >= len(cells):
                    raise InputError(f"{where}: only {len(cells)} cells, allowed: {self._width}")
                if place not in exact and not is_number(cells[place]):
                    raise InputError(
                        f"{where}: '{cells[place].strip()}', allowed: a number, nothing, or a text"
                        " named in csv.missing"
                    )


def _undecodable(path: Path, err: UnicodeDecodeError) -> str:
    return (
        f"{path}: no {err.encoding} text ({err.reason}), allowed: as csv.encoding says; programs of"
        " Windows often write cp1252"
    )
