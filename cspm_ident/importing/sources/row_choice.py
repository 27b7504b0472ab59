"""Rows of a log with a line per drive: `q[drive=3]` is column `q` where column `drive` is 3."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_CHOICE = re.compile(r"(?P<column>.+)\[(?P<key>[^\[\]=]+)=(?P<value>[^\[\]=]*)\]")


class RowChoice(NamedTuple):
    """A column, and which of its rows: those in which the column `key` has a value."""

    column: str
    key: str
    value: str

    @property
    def name(self) -> str:
        """As a mapping writes it."""
        return f"{self.column}[{self.key}={self.value}]"


def row_choice(name: str, columns: Collection[str] = ()) -> RowChoice | None:
    """Return what a name in a mapping chooses; None for that of one of `columns`, or of another."""
    found = None if name in columns else _CHOICE.fullmatch(name)
    if found is None:
        return None
    return RowChoice(found["column"], found["key"].strip(), found["value"].strip())


class Labels:
    """The texts of a column that chooses rows, by number, in the order in which they come.

    Attributes:
        known: the texts; numbers without needless digits, so that 3, 3.0 and 03 are one.
        textual, unit: as those of `TimeCells`.
    """

    textual = True
    unit = None

    def __init__(self) -> None:
        """Begin without any text."""
        self.known: list[str] = []

    def read(
        self, cells: NDArray[np.str_], line_of: Callable[[int], int] | None = None
    ) -> NDArray[np.int32]:
        """Return the number of the text of each cell, (n,) both; `line_of` has no use."""
        texts, places = np.unique(cells, return_inverse=True)
        numbers = np.array([self._number(plain(str(text))) for text in texts], dtype=np.int32)
        return numbers[places]

    def _number(self, text: str) -> int:
        if text not in self.known:
            self.known.append(text)
        return self.known.index(text)


def plain(text: str) -> str:
    """Return a text without blanks around it, and a number without needless digits."""
    text = text.strip()
    if text.isdecimal():
        return str(int(text))
    try:
        return f"{float(text):.12g}"
    except ValueError:
        return text
