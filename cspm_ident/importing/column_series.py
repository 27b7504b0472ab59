"""A column in SI with its stamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.time_base import Times

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ColumnSeries:
    """One column in SI with its stamps; several may share the same `times`.

    Attributes:
        read: opens the values; they leave memory with the last reference to what it returns.
        times: of the rows; None for a constant.
    """

    read: Callable[[], Array]
    times: Times | None

    @property
    def values(self) -> Array:
        """The values, shape (n,), on disk; a single number for a constant."""
        return self.read()
