"""An HDF5 file: MATLAB's version 7.3, or any other with vectors of numbers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.loaded_table import LARGEST_SIDE, LoadedTable, Vector, signals
from cspm_ident.importing.sources.mat_source import EXPORT
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library

LINEAR = {"scale_factor": 1.0, "add_offset": 0.0}
HOLES = ("_FillValue", "missing_value")
PACKING = (*LINEAR, *HOLES)
_HIDDEN = ("#refs#", "#subsystem#")


class Hdf5Source(LoadedTable):
    """An HDF5 file; groups and structures as `log.q`, arrays as in `MatSource`; see `Source`."""

    def __init__(self, path: Path, *, matlab: bool) -> None:
        """Read the file.

        Args:
            path: the file.
            matlab: MATLAB wrote it, and stores the last axis first.

        Raises:
            InputError: h5py is missing, the file is damaged, or holds no vector.
        """
        super().__init__(path)
        self.kind = "MATLAB file of version 7.3" if matlab else "HDF5 file"
        h5py = extra_library("h5py", "files", str(path), ", or a text table")
        objects: list[str] = []
        try:
            with h5py.File(path, "r") as file:
                found = dict(_vectors("", file, file, objects, matlab))
        except (OSError, RuntimeError, KeyError, ValueError) as err:
            reason = " ".join(str(err).split())
            raise InputError(f"{path}: no HDF5 file that can be read ({reason})") from None
        self._vectors = found
        self.columns = tuple(found)
        if objects:
            shown = ", ".join(objects[:5])
            self.notes.append(f"objects that MATLAB alone reads are left out: {shown}; {EXPORT}")
        if not found:
            hint = f"; {objects[0]} is an object of MATLAB: {EXPORT}" if objects else ""
            raise InputError(f"{path}: holds no vector of numbers, allowed: at least one{hint}")


def _vectors(
    name: str,
    node: Any,  # noqa: ANN401 - of h5py
    file: Any,  # noqa: ANN401 - of h5py
    objects: list[str],
    matlab: bool,
) -> Iterator[tuple[str, Vector]]:
    """Yield the vectors of numbers below a node, by name; keep names of what only MATLAB reads."""
    if hasattr(node, "keys"):
        for key in node:
            if key not in _HIDDEN:
                inner = f"{name}.{key}" if name else key
                yield from _vectors(inner, node[key], file, objects, matlab)
        return
    if "MATLAB_object_decode" in node.attrs:
        objects.append(name)
    elif node.dtype.names:
        for field in node.dtype.names:
            yield from _arrays(f"{name}.{field}", np.asarray(node[field]), matlab=False)
    elif node.dtype == object and node.size <= LARGEST_SIDE and matlab:
        for i, reference in enumerate(np.asarray(node).ravel()):
            yield from _vectors(f"{name}[{i}]", file[reference], file, objects, matlab)
    elif node.dtype.kind in "biuf" and node.attrs.get("MATLAB_class") != b"char":
        yield from _arrays(name, _scaled(node), matlab=matlab)


def _scaled(node: Any) -> Vector:  # noqa: ANN401 - of h5py
    """Return an array as its attributes say it is packed (CF conventions, 8.1)."""
    values = np.asarray(node)
    packing = {key: node.attrs[key] for key in PACKING if key in node.attrs}
    if not packing:
        return values
    holes = np.isin(values, [np.ravel(packing[key])[0] for key in HOLES if key in packing])
    scale, offset = (float(np.ravel(packing.get(key, one))[0]) for key, one in LINEAR.items())
    return np.where(holes, np.nan, exact_numbers(values) * scale + offset)


def _arrays(name: str, value: Vector, *, matlab: bool) -> list[tuple[str, Vector]]:
    value = np.squeeze(value.T if matlab else value)
    return signals(name, value) if value.ndim and value.dtype.kind in "biuf" else []
