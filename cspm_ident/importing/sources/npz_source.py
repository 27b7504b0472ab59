"""Arrays of numpy in one file, `.npz`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cspm_ident.importing.sources.loaded_table import LoadedTable, signals
from cspm_msgs_py.errors import InputError

# Reading a file of PyTorch runs what it names; this keeps its numbers alone.
FROM_TORCH = (
    "saved by numpy: numpy.savez('log.npz', **{k: v.cpu().numpy() for k, v in"
    " torch.load('log.pt').items()})"
)


class NpzSource(LoadedTable):
    """Arrays of numpy by name; matrices have columns as `dof_pos[0]`; see `Source`."""

    kind = "arrays of numpy"

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            InputError: it is damaged, or holds no vector of numbers.
        """
        super().__init__(path)
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                for name in file.files:
                    if (value := file[name]).dtype.kind in "biuf":
                        self._vectors |= dict(signals(name, value))
        except Exception as err:  # of many kinds, whatever the damage makes the reader do
            raise InputError(
                f"{path}: no arrays of numpy that can be read ({' '.join(str(err).split())})"
            ) from None
        self.columns = tuple(name for name, each in self._vectors.items() if each.ndim == 1)
        if not self.columns:
            raise InputError(f"{path}: holds no vector of numbers, allowed: at least one")
