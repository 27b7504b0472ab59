"""A column of times in a text table: numbers, or texts of one unit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.sources.number_text import is_number
from cspm_ident.importing.time_text import TEXT_UNITS, nanoseconds, unit_of_text
from cspm_msgs_py.errors import InputError


class TimeCells:
    """Reads the cells of one column of times, piece by piece.

    Attributes:
        unit: as the mapping says, else as its texts show; None for numbers without a unit.
    """

    def __init__(self, path: Path, name: str, unit: str | None) -> None:
        """Take the table and the column's name, for errors, and its unit, None if not said."""
        self.unit = unit
        self._path, self._name = path, name
        self._numbers = False

    @property
    def textual(self) -> bool:
        """Whether its cells are texts, as far as is known."""
        return self.unit in TEXT_UNITS

    def read(
        self, cells: NDArray[np.str_], line_of: Callable[[int], int]
    ) -> NDArray[np.longdouble]:
        """Return a piece as numbers of the unit, texts in ns, shape (n,).

        Args:
            cells: shape (n,).
            line_of: returns the number of the line of a cell, for errors.

        Raises:
            InputError: a cell is not of the unit, or of none that is known.
        """
        if not self.textual:
            try:
                blank = np.char.strip(cells) == ""
                found = np.where(blank, "nan", cells).astype(np.longdouble)
            except ValueError:
                self._find_unit(cells, line_of)
            else:
                self._numbers |= bool((~np.isnan(found)).any())
                return np.asarray(found)
        try:
            return nanoseconds(str(self.unit), (cell.strip() for cell in cells.tolist()))
        except ValueError as err:
            at = next(i for i, cell in enumerate(cells.tolist()) if cell.strip() == str(err))
            raise InputError(self._refusal(str(err), line_of(at))) from None

    def _find_unit(self, cells: NDArray[np.str_], line_of: Callable[[int], int]) -> None:
        """Take the unit of texts that can be of one only."""
        known = enumerate(cell.strip() for cell in cells.tolist())
        at, first = next((i, cell) for i, cell in known if cell and not is_number(cell))
        found = None if self._numbers else unit_of_text(first)
        if self.unit is not None or found is None:
            raise InputError(self._refusal(first, line_of(at)))
        self.unit = found

    def _refusal(self, cell: str, line: int) -> str:
        where = f"{self._path}: line {line}, column '{self._name}': '{cell}', allowed:"
        if self.textual:
            return f"{where} a text as {TEXT_UNITS[str(self.unit)]} by unit {self.unit}"
        forms = ", ".join(f"{unit} ({example})" for unit, example in TEXT_UNITS.items())
        return f"{where} a number, or a text with its unit of: {forms}"
