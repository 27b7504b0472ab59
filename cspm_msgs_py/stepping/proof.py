"""What somebody's drivers have to show before a run on hardware begins."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Proof(Protocol):
    """Asks drivers for small motions, and judges them; then it holds the machine."""

    @property
    def passed(self) -> bool:
        """Whether the drivers have shown that they are right."""

    @property
    def under_way(self) -> bool:
        """Whether it commands winches: from its first command on."""

    def restart(self) -> None:
        """Take note that a driver is missing."""

    def command(self, now_ns: int) -> tuple[int, Array] | None:
        """Return the stamp [ns] of the state answered and what drives are to obey, or None.

        Raises:
            InputError: the drivers are wrong, in one line.
        """

    def close(self) -> None:
        """Leave the topics."""
