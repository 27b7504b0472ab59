"""A log in JSON: a list of records, or arrays by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.loaded_table import LoadedTable, Vector, signals
from cspm_msgs_py.errors import InputError

# Read as a whole, which takes ten times its size in memory [bytes].
LARGEST = 200_000_000


class JsonSource(LoadedTable):
    """A JSON file; see `Source`.

    Either a list of records, alone or under one key, as better-actuator-models writes `entries`;
    or an array for each name. Arrays of several axes have columns as `q[0]`. Single numbers and
    texts beside them are notes.
    """

    kind = "JSON file"

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            InputError: it is too large, no JSON, or holds neither records nor arrays.
        """
        super().__init__(path)
        content = _content(path)
        records = _records(content)
        arrays = _joined(records) if records else content
        if not isinstance(arrays, dict):
            arrays = {}
        for name, value in arrays.items():
            column = _array(value)
            if column is not None:
                self._vectors |= dict(signals(name, column))
        self.columns = tuple(self._vectors)
        if not self.columns:
            raise InputError(
                f"{path}: holds no column, allowed: a list of records, or an array for each name"
            )
        single = content if isinstance(content, dict) else {}
        said = [f"{k} = {v}" for k, v in single.items() if isinstance(v, str | int | float)]
        if said:
            self.notes.append(f"single values in the file: {', '.join(said)}")


def _content(path: Path) -> Any:  # noqa: ANN401 - whatever the file holds
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(f"{path}: {size} bytes, allowed: at most {LARGEST}, or a text table")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as err:
        raise InputError(f"{path}: no JSON ({' '.join(str(err).split())})") from None


def _records(content: Any) -> list[dict[str, Any]]:  # noqa: ANN401 - whatever the file holds
    """Return the list of records that a file holds; none where it holds other things."""
    lists = [content] if isinstance(content, list) else []
    if isinstance(content, dict):
        lists = [value for value in content.values() if isinstance(value, list)]
    found = [each for each in lists if each and all(isinstance(row, dict) for row in each)]
    return found[0] if len(found) == 1 else []


def _joined(records: list[dict[str, Any]]) -> dict[str, list[Any]]:
    """Return the records' values by name, in order; what one lacks is no number there."""
    names = dict.fromkeys(name for record in records for name in record)
    return {name: [record.get(name) for record in records] for name in names}


def _array(value: Any) -> Vector | None:  # noqa: ANN401 - any JSON
    """Return a list as an array of numbers or texts; None where it is none."""
    if not isinstance(value, list):
        return None
    flat = all(not isinstance(each, list | dict) for each in value)
    if flat and any(isinstance(each, str) for each in value):
        return np.array([str(each) for each in value])
    try:
        # None, where a record lacks a value, becomes NaN.
        return exact_numbers(value)
    except (TypeError, ValueError, OverflowError):
        return None
