"""Which kind of file an import was given, by what it begins with."""

from __future__ import annotations

import gzip
import zlib
from contextlib import ExitStack
from pathlib import Path

from cspm_ident.importing.mapping import CsvFormat, MappingFile
from cspm_ident.importing.sources.bag_source import BagSource
from cspm_ident.importing.sources.bench_source import MdfSource, TdmsSource
from cspm_ident.importing.sources.csv_source import CsvSource
from cspm_ident.importing.sources.hdf5_source import Hdf5Source
from cspm_ident.importing.sources.joined_source import JoinedSource
from cspm_ident.importing.sources.json_source import JsonSource
from cspm_ident.importing.sources.mat_source import MatSource
from cspm_ident.importing.sources.npz_source import FROM_TORCH, NpzSource
from cspm_ident.importing.sources.parquet_source import ParquetSource
from cspm_ident.importing.sources.source import Source
from cspm_ident.importing.sources.spreadsheet_source import SpreadsheetSource
from cspm_ident.importing.sources.text_encoding import refuse_binary
from cspm_msgs_py.errors import InputError

_HDF5 = b"\x89HDF\r\n\x1a\n"
_BAGS = (b"\x89MCAP0\r\n", b"SQLite format 3\x00", b"#ROSBAG V2.0")
_MATLAB_5 = b"MATLAB 5.0 MAT-file"
_MATLAB_HDF5 = b"MATLAB 7.3 MAT-file"
_GZIP = b"\x1f\x8b"
_ZIP = b"PK\x03\x04"
_PARQUET = b"PAR1"
_TDMS = b"TDSm"
_MDF = (b"MDF     3", b"MDF     4", b"UnFinMF ")
_OLD_OFFICE = b"\xd0\xcf\x11\xe0"
_TORCH = (".pt", ".pth")
ALLOWED = (
    "allowed: a text table, .csv.gz, .json, .npz, .xlsx, .parquet, .mat, HDF5, TDMS or MDF"
    " file, or a bag"
)


def open_source(path: Path, mapping: MappingFile) -> Source:
    """Return the columns of a file, and of those beside it, ready to be read.

    Raises:
        InputError: one is missing, unreadable, or of no kind that can be read.
    """
    where, others = str(mapping.path), mapping.mapping.files
    first = _opened(path, mapping.mapping.csv, where)
    if not others:
        return first
    found: dict[str, Source] = {}
    with ExitStack() as refused:
        refused.callback(first.close)
        if first.stamped:
            raise InputError(f"{where}: files: beside a bag, allowed: beside a table")
        for name, other in others.items():
            place = mapping.path.parent / other.path
            found[name] = _opened(place, other.csv, f"{where}: files.{name}")
            refused.callback(found[name].close)
            if found[name].stamped:
                raise InputError(f"{where}: files.{name}.path: a bag, allowed: a table")
        refused.pop_all()
    return JoinedSource(first, found)


def _opened(path: Path, form: CsvFormat, where: str) -> Source:
    if path.is_dir():
        return BagSource(path)
    try:
        with path.open("rb") as file:
            start = file.read(1024)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, {ALLOWED}") from None
    except OSError as err:
        raise InputError(f"{path}: unreadable ({err.strerror})") from None
    if not start:
        raise InputError(f"{path}: an empty file, {ALLOWED}")
    if start.startswith(_BAGS):
        return BagSource(path)
    if (table := _binary_table(path, start, form)) is not None:
        return table
    packed = start.startswith(_GZIP)
    if packed:
        start = _unpacked_start(path)
    refuse_binary(path, start, form, " inside" if packed else "", ALLOWED)
    return CsvSource(path, form, where, packed=packed)


def _binary_table(path: Path, start: bytes, form: CsvFormat) -> Source | None:
    if start.startswith(_HDF5) or start.startswith(_MATLAB_HDF5):
        return Hdf5Source(path, matlab=not start.startswith(_HDF5) or path.suffix == ".mat")
    if start.startswith(_TDMS):
        return TdmsSource(path)
    if start.startswith(_MDF):
        return MdfSource(path)
    if start.startswith(_PARQUET):
        return ParquetSource(path)
    if path.suffix in _TORCH:
        raise InputError(f"{path}: a file of PyTorch, allowed: {FROM_TORCH}")
    if path.suffix == ".json":
        return JsonSource(path)
    if start.startswith(_ZIP) and path.suffix == ".npz":
        return NpzSource(path)
    if start.startswith(_ZIP):
        return SpreadsheetSource(path, form)
    if start.startswith(_OLD_OFFICE):
        raise InputError(f"{path}: an old spreadsheet (.xls), allowed: saved as .xlsx or .csv")
    if start.startswith(_MATLAB_5) or path.suffix == ".mat":
        return MatSource(path)
    return None


def _unpacked_start(path: Path) -> bytes:
    try:
        with gzip.open(path) as file:
            return file.read(1024)
    except (OSError, EOFError, zlib.error) as err:
        raise InputError(f"{path}: damaged gzip data ({' '.join(str(err).split())})") from None
