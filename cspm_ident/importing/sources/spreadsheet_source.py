"""A spreadsheet (.xlsx)."""

from __future__ import annotations

from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.mapping import CsvFormat
from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.loaded_table import LoadedTable, Vector
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library

Row = tuple[Any, ...]


class SpreadsheetSource(LoadedTable):
    """One sheet of a spreadsheet, its first unless the mapping names one; see `Source`.

    Cells with formulas count with the value that was saved.
    """

    kind = "spreadsheet"

    def __init__(self, path: Path, form: CsvFormat) -> None:
        """Read the sheet.

        Raises:
            InputError: openpyxl is missing, the file is damaged, there is no such sheet, or a row
                has more cells than there are names.
        """
        super().__init__(path)
        self._form = form
        rows = self._rows()
        first = form.first_line or form.names_line + 1
        if len(rows) < first:
            raise InputError(f"{path}: {len(rows)} rows, allowed: numbers from row {first} on")
        head = rows[form.names_line - 1] if form.names_line else rows[first - 1]
        names = [str(i + 1) if not form.names_line else _text(c) for i, c in enumerate(head)]
        while names and not names[-1]:
            names.pop()
        self.columns = form.names or tuple(names)
        body = [
            (number, row)
            for number, row in enumerate(rows[first - 1 :], start=first)
            if any(map(_text, row))
        ]
        self._check_widths(body)
        self._vectors = {
            name: self._column(name, [(n, row[i] if i < len(row) else None) for n, row in body])
            for i, name in enumerate(self.columns)
        }

    def _vector(self, name: str) -> Vector:
        vector = super()._vector(name)
        if vector.dtype.kind == "f" and len(vector) and np.isnan(vector).all():
            self._refuse_formulas(name)
        return vector

    def _refuse_formulas(self, name: str) -> None:
        """Refuse a column of formulas whose values were never saved."""
        place = self.columns.index(name)
        for number, row in enumerate(self._rows(values=False), start=1):
            cell = row[place] if place < len(row) else None
            if isinstance(cell, str) and cell.startswith("="):
                raise InputError(
                    f"{self.path}: row {number}, column '{name}': a formula without a saved value,"
                    " allowed: a sheet that was calculated and saved, or a .csv of it"
                )

    def _check_widths(self, body: list[tuple[int, Row]]) -> None:
        for number, row in body:
            if any(map(_text, row[len(self.columns) :])):
                raise InputError(
                    f"{self.path}: row {number}: more cells than the {len(self.columns)} names,"
                    " allowed: one each; `csv.names` gives a name to each"
                )

    def _rows(self, *, values: bool = True) -> list[Row]:
        openpyxl = extra_library("openpyxl", "files", str(self.path), ", or a text table")
        try:
            book = openpyxl.load_workbook(self.path, read_only=True, data_only=values)
        except Exception as err:  # of many kinds, whatever the damage makes the reader do
            raise InputError(
                f"{self.path}: no spreadsheet that can be read ({' '.join(str(err).split())})"
            ) from None
        try:
            sheets = {sheet.title: sheet for sheet in book.worksheets}
            chosen = self._form.sheet or next(iter(sheets), None)
            if chosen not in sheets:
                raise InputError(
                    f"{self.path}: no sheet '{chosen}', allowed: {', '.join(sheets) or 'one'}"
                )
            if len(sheets) > 1:
                self.notes.append(f"sheet {chosen} of {', '.join(sheets)}")
            return list(sheets[chosen].iter_rows(values_only=True))
        finally:
            book.close()

    def _column(self, name: str, cells: list[tuple[int, Any]]) -> Vector:
        """Return a column: numbers, dates, or texts, as its first cell that is not empty is."""
        absent = (None, "", *self._form.missing)
        known = [cell for _, cell in cells if cell not in absent]
        if known and all(isinstance(cell, datetime | date) for cell in known):
            found = [
                np.datetime64("NaT") if c in absent else np.datetime64(c, "ns") for _, c in cells
            ]
            return np.array(found, dtype="datetime64[ns]")
        if known and all(isinstance(cell, str | time) for cell in known):
            return np.array(["" if cell in absent else _text(cell) for _, cell in cells])
        values: list[float] = [np.nan] * len(cells)
        for i, (number, cell) in enumerate(cells):
            if cell in absent:
                continue
            if not isinstance(cell, int | float):
                raise InputError(
                    f"{self.path}: row {number}, column '{name}': '{cell}', allowed: a number,"
                    " nothing, or a text named in csv.missing"
                )
            values[i] = cell
        return exact_numbers(values)


def _text(cell: Any) -> str:  # noqa: ANN401 - what a cell holds
    return "" if cell is None else str(cell).strip()
