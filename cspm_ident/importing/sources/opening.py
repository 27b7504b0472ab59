"""Which kind of file an import was given, by what it begins with."""

from __future__ import annotations

from pathlib import Path

from cspm_ident.importing.mapping import MappingFile
from cspm_ident.importing.sources.bag_source import BagSource
from cspm_ident.importing.sources.csv_source import CsvSource
from cspm_ident.importing.sources.mat_source import MatSource
from cspm_ident.importing.sources.source import Source
from cspm_msgs_py.errors import InputError

_HDF5 = b"\x89HDF\r\n\x1a\n"
_BAGS = (b"\x89MCAP0\r\n", b"SQLite format 3\x00", b"#ROSBAG V2.0")
_MATLAB_5 = b"MATLAB 5.0 MAT-file"
_MATLAB_HDF5 = b"MATLAB 7.3 MAT-file"


def open_source(path: Path, mapping: MappingFile) -> Source:
    """Return a file's columns, ready to be read.

    Raises:
        InputError: it is missing, unreadable, or of no kind that can be read.
    """
    if path.is_dir():
        return BagSource(path)
    try:
        with path.open("rb") as file:
            start = file.read(512)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, allowed: a text table, .mat file or bag") from None
    except OSError as err:
        raise InputError(f"{path}: unreadable ({err.strerror})") from None
    if not start:
        raise InputError(f"{path}: an empty file, allowed: a text table, .mat file or bag")
    if start.startswith(_BAGS):
        return BagSource(path)
    if start.startswith((_HDF5, _MATLAB_HDF5)):
        raise InputError(
            f"{path}: HDF5, as MATLAB writes with -v7.3, allowed: save(…, '-v7') or a text table"
        )
    if start.startswith(_MATLAB_5) or path.suffix == ".mat":
        return MatSource(path)
    wide = mapping.mapping.csv.encoding.lower().replace("_", "-").startswith("utf-16")
    if b"\x00" in start and not wide:
        raise InputError(f"{path}: no text, allowed: a text table, .mat file or bag")
    return CsvSource(path, mapping.mapping.csv, str(mapping.path))
