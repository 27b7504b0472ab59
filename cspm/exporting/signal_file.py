"""A file with signals, in the format that its name's ending says."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np

from cspm.exporting.signal_table import table_of
from cspm.signals import Signal
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library

TIME = "time"


def write_signals(path: Path, signals: Sequence[Signal]) -> None:
    """Write signals as a text table, as Parquet or for MATLAB.

    A table has a row for each stamp, and nothing where a signal has none then. In a text table a
    column's name ends with its unit in brackets; Parquet has it as the field's metadata `unit`. A
    MATLAB file has a structure for each signal: `time`, `values`, `columns`, `units`.

    Raises:
        InputError: another ending, a file that exists, a folder that does not, or pyarrow is not
            installed.
    """
    check_place(path)
    _WRITERS[path.suffix](path, signals)


def check_place(path: Path) -> None:
    """Refuse a file that cannot be written, before any work.

    Raises:
        InputError: as `write_signals`.
    """
    if path.suffix not in _WRITERS:
        raise InputError(f"{path}: allowed: a name that ends with {', '.join(_WRITERS)}")
    if path.exists() or not path.absolute().parent.is_dir():
        raise InputError(f"{path}: allowed: a new file in a folder that exists")
    if path.suffix == ".parquet":
        _parquet(path)


def _parquet(path: Path) -> Any:  # noqa: ANN401 - a module
    return extra_library("pyarrow.parquet", "files", str(path), ", or .csv or .mat")


def _write_csv(path: Path, signals: Sequence[Signal]) -> None:
    table = table_of(signals)
    names = [f"{name} [{unit}]" if unit else name for name, unit in table.units.items()]
    rows = np.column_stack([table.time, *table.columns.values()])
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([f"{TIME} [s]", *names])
        for row in rows.tolist():
            writer.writerow(["" if isnan(value) else value for value in row])


def _write_parquet(path: Path, signals: Sequence[Signal]) -> None:
    parquet = _parquet(path)
    pa = extra_library("pyarrow", "files", str(path))
    table = table_of(signals)
    fields = [pa.field(TIME, pa.float64(), metadata={"unit": "s"})]
    fields += [pa.field(n, pa.float64(), metadata={"unit": u}) for n, u in table.units.items()]
    columns = [pa.array(values, from_pandas=True) for values in table.columns.values()]
    arrays = [pa.array(table.time), *columns]
    parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), path)


def _write_mat(path: Path, signals: Sequence[Signal]) -> None:
    from scipy.io import savemat

    content = {
        each.name: {
            "time": each.time,
            "values": each.values,
            "columns": np.array(each.columns, dtype=object),
            "units": np.array(each.units, dtype=object),
        }
        for each in signals
    }
    savemat(path, content, do_compression=True, oned_as="column")


_WRITERS: dict[str, Callable[[Path, Sequence[Signal]], None]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mat": _write_mat,
}
