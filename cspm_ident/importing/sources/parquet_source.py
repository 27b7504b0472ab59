"""A Parquet file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.loaded_table import LoadedTable, Vector
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library


class ParquetSource(LoadedTable):
    """A Parquet file, of which only the columns that are used are read; see `Source`."""

    kind = "Parquet file"

    def __init__(self, path: Path) -> None:
        """Read the names of the columns.

        Raises:
            InputError: pyarrow is missing, or the file is damaged.
        """
        super().__init__(path)
        parquet = extra_library("pyarrow.parquet", "files", str(path), ", or a text table")
        try:
            self._file = parquet.ParquetFile(path)
        except Exception as err:  # of many kinds, whatever the damage makes the reader do
            raise InputError(
                f"{path}: no Parquet file that can be read ({' '.join(str(err).split())})"
            ) from None
        self.columns = tuple(self._file.schema_arrow.names)

    def _vector(self, name: str) -> Vector:
        try:
            found = self._file.read(columns=[name]).column(name)
            kind, holes = str(found.type), found.is_null().to_numpy()
            if kind.startswith("decimal"):
                texts = found.cast("string").fill_null("nan").to_numpy(zero_copy_only=False)
                return np.asarray(texts.astype(str).astype(np.longdouble))
            if "int" in kind and holes.any():
                return np.where(holes, np.nan, exact_numbers(found.fill_null(0).to_numpy()))
            return np.asarray(found.to_numpy(zero_copy_only=False))
        except Exception as err:  # see above
            raise InputError(
                f"{self.path}: column '{name}' cannot be read ({' '.join(str(err).split())})"
            ) from None

    def close(self) -> None:
        """Close the file."""
        self._file.close()
