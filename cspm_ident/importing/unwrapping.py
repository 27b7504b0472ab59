"""Counters that start again at zero, made continuous."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class Unwrapper:
    """Makes a counter continuous, piece by piece: every step is taken the shorter way round.

    Attributes:
        turns: how often the counter passed its end, both ways together.
        largest_step: largest step between neighbours, as a share of the counter's range; near 0.5
            the direction of a step is a guess.
    """

    def __init__(self, period: float) -> None:
        """Begin with what the counter counts to before it starts again."""
        self.turns, self.largest_step = 0, 0.0
        self._period, self._passed = period, 0.0
        self._last: Array | None = None

    def take(self, values: Array) -> Array:
        """Return the next piece, shape (n,), continuous; NaN is passed over, the type is kept."""
        out: Array = values.copy()
        known = np.flatnonzero(~np.isnan(values))
        if not len(known):
            return out
        numbers, period = values[known], values.dtype.type(self._period)
        step = np.diff(numbers, prepend=numbers[:1] if self._last is None else self._last)
        turns = -np.round(step / period)
        passed = self._passed + np.cumsum(turns)
        out[known] += passed * period
        self.turns += int(np.abs(turns).sum())
        rest = float(np.abs(step + turns * period).max())
        self.largest_step = max(self.largest_step, rest / self._period)
        self._last, self._passed = numbers[-1:], passed[-1]
        return out
