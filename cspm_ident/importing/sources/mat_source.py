"""A MATLAB file up to version 7."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.sources.loaded_table import LARGEST_SIDE, LoadedTable, Vector, signals
from cspm_msgs_py.errors import InputError

EXPORT = (
    "writetable(T, 'lab.csv'), or s = table2struct(T, 'ToScalar', true); save('lab.mat', '-struct',"
    " 's', '-v7')"
)
"""What to do with a table T in MATLAB so that others can read it."""


class MatSource(LoadedTable):
    """A MATLAB file up to version 7; columns of structures as `log.q`; see `Source`.

    Columns of a matrix have a number in brackets, 0 for the first, those of arrays of more axes a
    number for each but the longest, which is time. So have elements of a cell or structure array.
    """

    kind = "MATLAB file"

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            InputError: it is damaged, holds no vector, or only objects of MATLAB's own.
        """
        super().__init__(path)
        found = _content(path)
        self._vectors = {name: v for key, value in found for name, v in _vectors(key, value)}
        self.columns = tuple(self._vectors)
        scalars = [f"{key} = {value:g}" for key, value in found if _is_scalar(value)]
        if scalars:
            self.notes.append(f"single numbers in the file: {', '.join(scalars)}")
        opaque = [key for key, value in found if _is_opaque(key, value)]
        if opaque and not self.columns:
            raise InputError(
                f"{path}: holds tables, datetimes or other objects that MATLAB alone reads,"
                f" allowed: numbers; in MATLAB: {EXPORT}"
            )
        if opaque:
            self.notes.append(f"objects that MATLAB alone reads are left out; for tables: {EXPORT}")
        if not self.columns:
            raise InputError(f"{path}: holds no vector of numbers, allowed: at least one")


def _content(path: Path) -> list[tuple[str, Any]]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            # It warns of tables that it cannot name, and we say so ourselves.
            warnings.simplefilter("ignore")
            content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as err:  # of many kinds, whatever the damage makes the reader do
        raise InputError(
            f"{path}: no MATLAB file that can be read ({' '.join(str(err).split())}), allowed:"
            " save(…, '-v7')"
        ) from None
    return [(k, v) for k, v in content.items() if not k.startswith("__")]


def _is_scalar(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, np.complexfloating)


def _is_opaque(key: str, value: object) -> bool:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    return key == "None" or isinstance(value, MatlabOpaque | MatlabFunction)


def _vectors(name: str, value: Any) -> Iterator[tuple[str, Vector]]:  # noqa: ANN401 - any
    """Yield the vectors of numbers in a value that MATLAB saved, by name."""
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _vectors(f"{name}.{field}", getattr(value, field))
    elif _is_opaque(name, value):
        return
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for i, inner in enumerate(value.ravel()[:LARGEST_SIDE]):
            yield from _vectors(f"{name}[{i}]", inner)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.ndim:
        yield from signals(name, value)
