"""Lines of a text table that hold no row: lost to a power cut, cut off, or words below the rows."""

from __future__ import annotations

from cspm_ident.importing.sources.row_shape import RowShape
from cspm_ident.importing.sources.table_head import LOOKALIKES

Lines = list[str]
_MOST_WORDS = 30
"""Lines with statistics below the numbers; more of them are rows that begin with words."""
_ALIKE = 10
_NUMBERS = ("nan", "inf", "infinity")


class TableEnd:
    """Takes out lines that hold no row, and notes which."""

    def __init__(self, rows: RowShape, width: int, notes: list[str]) -> None:
        """Take the shape of rows, how many cells they have, and where to note what is left out."""
        self._rows, self._width, self._notes = rows, width, notes

    def plain(self, lines: Lines, line: int) -> Lines:
        """Return lines with usual blanks and minus signs; those with zero bytes become empty.

        Args:
            lines: as read.
            line: number of the first.
        """
        if not all(map(str.isascii, lines)):
            lines = [row.translate(LOOKALIKES).replace("\u200b", "") for row in lines]
        lost = [i for i, row in enumerate(lines) if "\0" in row]
        if lost:
            zeros = sum(lines[i].count("\0") for i in lost)
            first, many = line + lost[0], len(lost) > 1
            where = f"line {first}" + (f" and {len(lost) - 1} more hold" if many else " holds")
            self._notes.append(f"{where} {zeros} zero bytes (power lost?), left out")
            lines = ["\n" if "\0" in row else row for row in lines]
        return lines

    def without_end(self, lines: Lines, line: int) -> Lines:
        """Return the last lines of a table without one that is cut, and words below the numbers."""
        lines = list(lines)
        how = self._cut(lines) if lines and not lines[-1].endswith("\n") else None
        if how is not None:
            number = line + len(lines) - 1
            self._notes.append(f"line {number}, the last, is cut short{how} and left out")
            lines.pop()
        count = self._words(lines)
        if count:
            first = line + len(lines) - count
            shown = ", ".join(repr(self._first(row)) for row in lines[-count:][:3])
            span = (
                f"line {first} holds"
                if count == 1
                else f"lines {first} to {first + count - 1} hold"
            )
            self._notes.append(f"{span} words below the numbers ({shown}), left out")
            del lines[-count:]
        return lines

    def _first(self, row: str) -> str:
        cells = self._rows.cells(self._rows.content(row))
        return cells[0].strip() if cells else ""

    def _cut(self, lines: Lines) -> str | None:
        """Return in words how a last line without its end is cut; None where it is whole."""
        cells = self._rows.cells(lines[-1])
        if len(cells) < self._width:
            return ""
        before = [self._rows.cells(row)[-1:] for row in lines[-1 - _ALIKE : -1]]
        usual = {_decimals(each[0]) for each in before if each}
        if len(before) < _ALIKE or len(usual) != 1 or _decimals(cells[-1]) >= usual.pop():
            return None
        return f" ('{cells[-1].strip()}' has fewer digits than all before)"

    def _words(self, lines: Lines) -> int:
        """Return how many lines at the end begin with a word, below others that do not."""
        for count, row in enumerate(reversed(lines[-_MOST_WORDS - 1 :])):
            first = self._first(row)
            worded = first[:1].isalpha() and first.lower() not in _NUMBERS
            if not worded and (first or self._holds_more(row)):
                return count
        return 0

    def _holds_more(self, row: str) -> bool:
        """Return whether a line has a cell beyond the names: a row, which is refused later."""
        cells = self._rows.cells(self._rows.content(row))
        return any(cell.strip() for cell in cells[self._width :])


def _decimals(cell: str) -> int:
    return len(cell.strip().partition(".")[2])
