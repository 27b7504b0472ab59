"""What a safe state offers to whoever enters it: torques and brakes."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Winches(NamedTuple):
    """Angles [rad] and speeds [rad/s] at the motor shafts, (n,) each."""

    angles: Array
    speeds: Array


class SafeState(Protocol):
    """A safe state: entered by `begin`, then asked for the torques again and again."""

    name: str

    @property
    def brake(self) -> bool:
        """Whether the winches' brakes are to be set."""

    def begin(self, tensions: Array | None) -> None:
        """Enter it with the tensions (n,) [N] measured last, None where none are known."""

    def torque(self, now_ns: int, winches: Winches | None) -> Array:
        """Return the motor torques (n,) [N·m]; `winches` is None where their state is unknown."""
