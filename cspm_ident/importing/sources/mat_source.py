"""A MATLAB file up to version 7: arrays and structures of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.source import Progress, check_columns
from cspm_ident.importing.sources.table_source import TableSource
from cspm_msgs_py.errors import InputError

_LARGEST_SIDE = 1000  # columns of a matrix that are given names


class MatSource(TableSource):
    """The vectors of a MATLAB file; see `Source`.

    Vectors have the name that MATLAB has for them, such as `log.q`; columns of a matrix have their
    number behind it, `log.q[0]` for the first; so have elements of a cell or structure array.
    The longer side of a matrix is time.
    """

    kind = "MATLAB file"
    stamped = False

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            InputError: it is damaged, or holds no vector.
        """
        from scipy.io import loadmat

        self.path = path
        self.notes: list[str] = []
        try:
            content = loadmat(path, squeeze_me=True, struct_as_record=False)
        except Exception as err:  # of many kinds, whatever the damage makes the reader do
            raise InputError(
                f"{path}: no MATLAB file that can be read ({' '.join(str(err).split())}), allowed:"
                " save(…, '-v7')"
            ) from None
        found = [(k, v) for k, v in content.items() if not k.startswith("__")]
        self._vectors = {name: v for key, value in found for name, v in _vectors(key, value)}
        self.columns = tuple(self._vectors)
        scalars = [f"{key} = {value:g}" for key, value in found if _is_scalar(value)]
        if scalars:
            self.notes.append(f"single numbers in the file: {', '.join(scalars)}")
        if not self.columns:
            raise InputError(f"{path}: holds no vector of numbers, allowed: at least one")

    def read(
        self,
        numbers: Collection[str],
        times: Collection[str],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns; see `Source`."""
        check_columns(numbers, times, self.columns, self.path)
        for name in numbers:
            store.append(name, self._vectors[name].astype(np.float64))
        for name in times:
            store.append(name, self._vectors[name].astype(np.longdouble))
        progress(1.0)


def _is_scalar(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, np.complexfloating)


def _vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:  # noqa: ANN401 - any
    """Yield the vectors of numbers in a value that MATLAB saved, by name."""
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _vectors(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for i, inner in enumerate(value.ravel()[:_LARGEST_SIDE]):
            yield from _vectors(f"{name}[{i}]", inner)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        if value.ndim == 1:
            yield name, value
        elif value.ndim == 2 and min(value.shape) <= _LARGEST_SIDE:
            upright = value if value.shape[0] >= value.shape[1] else value.T
            yield from ((f"{name}[{i}]", column) for i, column in enumerate(upright.T))
