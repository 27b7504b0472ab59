"""Where the numbers of a text table begin, under which names, and with what between the cells."""

from __future__ import annotations

import csv
import re
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

from cspm_ident.importing.mapping import CsvFormat
from cspm_ident.importing.units import TIME_UNITS, is_unit
from cspm_msgs_py.errors import InputError

_DELIMITERS = (",", ";", "\t", "|")
_SEPARATOR = re.compile(r'"?sep=(.)"?\s*$', re.IGNORECASE)
_MOST_LINES = 8  # of one row of names
_OTHER_BLANKS = "\u00a0\u2007\u2009\u202f"
LOOKALIKES = str.maketrans(_OTHER_BLANKS + "\u2212\ufeff", " " * len(_OTHER_BLANKS) + "-\u200b")
"""Blanks that do not break and the typographer's minus, as programs for people write them."""


class TableHead(NamedTuple):
    """What is above the numbers.

    Attributes:
        cells: of the line of names, or of the first line of numbers where there are no names.
        first: line of the first numbers, from 1.
        delimiter: between cells, None for blanks.
        notes: what a person should know.
    """

    cells: list[str]
    first: int
    delimiter: str | None
    notes: list[str]


def table_head(file: TextIO, form: CsvFormat, path: Path) -> TableHead:
    """Return what is above the numbers of a table.

    A first line `sep=;` names the delimiter; names in quotes may go over several lines; a line of
    units below the names is passed over, unless the mapping says where the numbers begin.

    Args:
        file: at its beginning.
        form: how the table is written, as far as the mapping says it.
        path: the table, for errors.

    Raises:
        InputError: there is no such line.
        UnicodeDecodeError: it is no text in this encoding.
    """
    least = form.first_line or form.names_line + 1
    lines = [line.translate(LOOKALIKES) for line in islice(file, least + _MOST_LINES)]
    separator = _SEPARATOR.match(lines[0]) if lines and form.names_line == 1 else None
    names_line = 2 if separator else form.names_line
    first = max(form.first_line or 0, names_line + 1)
    if len(lines) < first:
        raise InputError(f"{path}: {len(lines)} lines, allowed: numbers from line {first} on")
    head = lines[names_line - 1] if names_line else lines[first - 1]
    more = 0
    while names_line and head.count('"') % 2 and names_line + more < len(lines):
        head += lines[names_line + more]
        more += 1
    head = head.removeprefix(form.comment)
    notes: list[str] = []
    delimiter = separator[1] if separator else _delimiter(head, form, notes)
    cells = [cell.strip() for cell in _cells(head, form.delimiter or delimiter)]
    if form.first_line is None and names_line:
        first += more
        below = _cells(lines[first - 1], delimiter) if len(lines) >= first else []
        if _are_units(below):
            notes.append(f"line {first} holds units ({', '.join(below)}), left out")
            first += 1
    return TableHead(cells, first, delimiter, notes)


def _delimiter(head: str, form: CsvFormat, notes: list[str]) -> str | None:
    if form.delimiter is not None:
        return None if form.delimiter == "blank" else form.delimiter
    found = max(_DELIMITERS, key=head.count)
    if head.count(found) == 0:
        blank = len(head.split()) > 1
        notes.append(f"cells are separated by {'blanks' if blank else 'nothing'}")
        return None if blank else ","
    notes.append(f"cells are separated by {found!r}, by its first line")
    return found


def _cells(text: str, delimiter: str | None) -> list[str]:
    if delimiter is None or delimiter == "blank":
        return text.split()
    return next(csv.reader(text.splitlines(keepends=True), delimiter=delimiter), [])


def _are_units(cells: list[str]) -> bool:
    """Return whether cells are units, in brackets or known, none of them a number."""
    known = [cell.strip() for cell in cells if cell.strip()]
    bare = [cell.strip("[]() ") for cell in known]
    marked = [cell[0] in "[(" and cell[-1] in "])" for cell in known]
    units = [is_unit(cell) or cell in TIME_UNITS or cell == "-" for cell in bare]
    numbers = [cell.replace(".", "").isdigit() for cell in bare]
    return (
        bool(known) and not any(numbers) and all(a or b for a, b in zip(marked, units, strict=True))
    )
