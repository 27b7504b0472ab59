"""What a run needs of a plant, whoever implements it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


class AnyPlant(Protocol):
    """What a run needs of a plant; the attributes are those of `cspm_sim.plant.Plant`.

    The arrays keep their place while the plant moves. `locked` may be set at any time and stops all
    motors.
    """

    testbed: Testbed
    steps: int
    locked: bool
    cut: tuple[str, ...]
    bar_state: Array
    angles: Array
    speeds: Array
    tensions: Array
    unstretched_lengths: Array
    frame: Array

    @property
    def time(self) -> float:
        """Time since the start [s]."""

    def step(self, torque: Array) -> None:
        """Advance by one period with the motor torques (n,) [N·m] held."""

    def applied_torque(self, torque: Array) -> Array:
        """Return what the drives deliver for a torque command, (n,) [N·m]."""

    def part(self, cable: str) -> None:
        """Let a cable part now.

        Raises:
            InputError: the plant cannot.
        """
