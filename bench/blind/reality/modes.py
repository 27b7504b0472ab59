"""Modes of a structure, each an oscillator of its own, brought forward in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def swung(
    place: Array, speed: Array, stiffness: Array, loss: Array, push: Array, period: float
) -> tuple[Array, Array]:
    """Return place and speed after a period [s] of q̈ = push − loss·q̇ − stiffness·q.

    By the implicit midpoint rule, which neither gains nor loses energy and is stable at any step.
    All are per modal mass and of shapes that go together.

    Args:
        place: q at the beginning.
        speed: q̇ at the beginning.
        stiffness: square of the mode's own frequency [1/s²].
        loss: decay of the speed [1/s].
        push: force in the middle of the period.
        period: time [s].
    """
    half = 0.5 * period
    middle = (speed + half * (push - stiffness * place)) / (1.0 + half * (loss + half * stiffness))
    return place + period * middle, 2.0 * middle - speed
