"""What says in real time whether a machine can have measured what came."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Plausibility(Protocol):
    """Judges messages one after another; see `cspm_control.plausibility`."""

    def fault(
        self, topic: str, stamp_ns: int, row: Array, rows: Mapping[str, Array], *, running: bool
    ) -> str | None:
        """Take a message; return in one line why it cannot be true, None if it can.

        Args:
            topic: its topic.
            stamp_ns: its stamp [ns].
            row: its numbers.
            rows: the latest believed rows of all topics that the node reads.
            running: whether the run has begun and the winches are not in their safe state.
        """


class Anything:
    """Finds everything plausible."""

    def fault(
        self, topic: str, stamp_ns: int, row: Array, rows: Mapping[str, Array], *, running: bool
    ) -> str | None:
        """Return None."""
        return None
