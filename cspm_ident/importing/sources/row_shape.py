"""Rows of a text table held against its names: as many cells, and numbers in the form declared."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from io import StringIO
from pathlib import Path

from cspm_ident.importing.mapping import CsvFormat
from cspm_ident.importing.sources.number_text import is_number
from cspm_msgs_py.errors import InputError

_SHOWN = 6


class RowShape:
    """How many cells a row has, and which marks its numbers may have.

    Attributes:
        trailing: how many rows had empty cells after the last name.
    """

    def __init__(
        self, path: Path, names: Sequence[str], delimiter: str | None, form: CsvFormat
    ) -> None:
        """Take the declaration.

        Args:
            path: the table, for errors.
            names: of the columns, in order.
            delimiter: between cells, None for blanks.
            form: how the table is written.
        """
        self.trailing = 0
        self._path, self._names, self._delimiter, self._form = path, names, delimiter, form
        self._width = len(names)
        # A separator behind the last name makes no column.
        self._least = max((i + 1 for i, name in enumerate(names) if name), default=self._width)
        self._grouping = _grouping(form)

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line."""
        if self._delimiter is None:
            return line.split()
        return next(csv.reader([line.rstrip("\n")], delimiter=self._delimiter), [])

    def content(self, row: str) -> str:
        """Return a line without its comment."""
        return row.split(self._form.comment)[0] if self._form.comment else row

    def is_void(self, row: str) -> bool:
        """Return whether a line has nothing but blanks and a comment."""
        return not self.content(row).strip()

    def check_widths(self, lines: list[str], line: int) -> list[str]:
        """Return the lines, the short ones filled if that was asked for.

        Args:
            lines: as read.
            line: number of the first.

        Raises:
            InputError: a row has more or fewer cells than there are names.
        """
        out = lines
        for i, row in enumerate(lines):
            count = self._count(row)
            if count == self._width or self.is_void(row):
                continue
            if count > self._width:
                self._refuse_longer(row, line + i, count)
            elif count < self._least and self._form.short_rows == "fill":
                out = list(lines) if out is lines else out
                mark = " nan" if self._delimiter is None else self._delimiter
                out[i] = self.content(row).rstrip("\r\n") + mark * (self._width - count) + "\n"
            elif count < self._least:
                raise InputError(
                    f"{self._path}: line {line + i}: only {count} cells under {self._named()},"
                    " allowed: one each; csv.short_rows: fill takes the others as missing"
                )
        return out

    def _count(self, row: str) -> int:
        content = self.content(row)
        if self._delimiter is None:
            return len(content.split())
        if '"' in content:
            return len(self.cells(content))
        return content.count(self._delimiter) + 1

    def _refuse_longer(self, row: str, line: int, count: int) -> None:
        if not any(cell.strip() for cell in self.cells(self.content(row))[self._width :]):
            self.trailing += 1
            return
        hint = "`csv.names` gives a name to each"
        if self._delimiter == ",":
            hint += "; a decimal comma needs another delimiter, or numbers in quotes"
        raise InputError(
            f"{self._path}: line {line}: {count} cells under {self._named()}, allowed: one each;"
            f" {hint}"
        )

    def _named(self) -> str:
        shown = ", ".join(self._names[:_SHOWN]) + ", …" * (self._width > _SHOWN)
        return f"{self._width} names ({shown})"

    def plain_numbers(self, lines: list[str], line: int, numeric: Collection[int]) -> list[str]:
        """Return the lines with decimal points, and without marks between thousands.

        Args:
            lines: as read.
            line: number of the first.
            numeric: places of the cells that hold numbers.

        Raises:
            InputError: a number has a point under a decimal comma, and none was declared as mark
                between thousands; or such marks stand elsewhere than between groups of three.
        """
        form = self._form
        if form.decimal == "," and form.thousands != ".":
            self._refuse_points(lines, line, numeric)
        if form.thousands is not None and self._grouping is not None:
            lines = [self._ungrouped(row, line + i, numeric) for i, row in enumerate(lines)]
        return [row.replace(",", ".") for row in lines] if form.decimal == "," else lines

    def _refuse_points(self, lines: list[str], line: int, numeric: Collection[int]) -> None:
        for i, row in enumerate(lines):
            if "." not in row:
                continue
            for place, cell in self._chosen(row, numeric):
                if "." in cell and is_number(cell.replace(".", "").replace(",", ".")):
                    raise InputError(
                        f"{self._path}: line {line + i}, column '{self._names[place]}': '{cell}'"
                        " has a point where csv.decimal is a comma, allowed: csv.thousands: '.'"
                        " for points between thousands, or csv.decimal: '.'"
                    )

    def _chosen(self, row: str, places: Collection[int]) -> list[tuple[int, str]]:
        found = self.cells(self.content(row))
        return [(place, found[place].strip()) for place in places if place < len(found)]

    def _ungrouped(self, row: str, line: int, numeric: Collection[int]) -> str:
        mark = self._form.thousands
        if mark is None or self._grouping is None or mark not in row:
            return row
        cells = self.cells(self.content(row))
        for place in numeric:
            cell = cells[place].strip() if place < len(cells) else ""
            if mark not in cell:
                continue
            if not self._grouping.match(cell):
                raise InputError(
                    f"{self._path}: line {line}, column '{self._names[place]}': '{cell}', allowed:"
                    f" {mark!r} between groups of three digits only"
                )
            cells[place] = cell.replace(mark, "")
        return self._joined(cells)

    def _joined(self, cells: list[str]) -> str:
        if self._delimiter is None:
            return " ".join(cells) + "\n"
        text = StringIO()
        csv.writer(text, delimiter=self._delimiter, lineterminator="\n").writerow(cells)
        return text.getvalue()


def _grouping(form: CsvFormat) -> re.Pattern[str] | None:
    if form.thousands is None:
        return None
    mark, point = re.escape(form.thousands), re.escape(form.decimal)
    return re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{mark}\d{{3}})+(?:{point}\d*)?(?:[eE][+-]?\d+)?$")
