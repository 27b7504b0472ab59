"""Columns of any length kept on disk while an import works on them, so that memory is bounded."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from mmap import MADV_DONTNEED, mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.closing import Closing

Array = NDArray[Any]
PIECE = 200_000
"""Rows that are worked on at a time."""


def pieces(count: int, *columns: Array) -> Iterator[slice]:
    """Yield slices that cover a number of rows, a piece each; release columns after each."""
    for start in range(0, count, PIECE):
        yield slice(start, min(start + PIECE, count))
        release(*columns)


def release(*columns: Array) -> None:
    """Let the pages of columns of a store leave memory; they are read again when used."""
    for column in columns:
        owner: Any = column
        while isinstance(owner, np.ndarray):
            owner = owner.base
        if isinstance(owner, mmap):
            owner.madvise(MADV_DONTNEED)


class ColumnStore(Closing):
    """Arrays that grow by pieces and are read back as if they were in memory.

    Leaving the context removes what was stored.
    """

    def __init__(self) -> None:
        """Create an empty temporary folder."""
        self._folder = ScratchFolder("import")
        self._kinds: dict[str, np.dtype[Any]] = {}
        self._paths: dict[str, Path] = {}
        self._prefix = ""

    def under(self, prefix: str) -> ColumnStore:
        """Return this store as one in which all names begin with a prefix."""
        found = copy(self)
        found._prefix = self._prefix + prefix
        return found

    def append(self, name: str, piece: Array) -> None:
        """Add a piece, shape (n,), to the column of that name."""
        name = self._prefix + name
        if name not in self._paths:
            self._begin(name, piece.dtype)
        elif piece.dtype == np.longdouble != self._kinds[name]:
            self._widen(name)
        with self._paths[name].open("ab") as file:
            file.write(np.ascontiguousarray(piece, dtype=self._kinds[name]).data)

    def new(self) -> str:
        """Return a name that no column has, for integers."""
        name = f"#{len(self._paths)}"
        self._begin(self._prefix + name, np.dtype(np.int64))
        return name

    def _begin(self, name: str, kind: np.dtype[Any]) -> None:
        self._paths[name] = self._folder.path / f"{len(self._paths)}.bin"
        self._paths[name].touch()
        self._kinds[name] = kind

    def _widen(self, name: str) -> None:
        """Store a column anew as longdouble, as its next piece needs."""
        narrow, kind = self._paths[name], self._kinds[name]
        self._kinds[name] = np.dtype(np.longdouble)
        self._paths[name] = narrow.with_suffix(".long")
        with narrow.open("rb") as file, self._paths[name].open("wb") as wide:
            while piece := file.read(PIECE * kind.itemsize):
                wide.write(np.frombuffer(piece, dtype=kind).astype(np.longdouble).data)
        narrow.unlink()

    def column(self, name: str) -> Array:
        """Return a column, shape (n,), read from disk as it is used; empty if nothing was added."""
        name = self._prefix + name
        if name not in self._paths or not self._paths[name].stat().st_size:
            return np.zeros(0, dtype=self._kinds.get(name, np.dtype(np.float64)))
        return np.memmap(self._paths[name], dtype=self._kinds[name], mode="r")

    def close(self) -> None:
        """Remove what was stored."""
        self._folder.close()
