"""Counters that start again at zero, made continuous."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class Unwrapped(NamedTuple):
    """A continuous signal.

    Attributes:
        values: shape (n,), in the unit of the counter.
        turns: how often it passed its end, both ways together.
        largest_step: largest step between neighbours, as a share of the counter's range; near 0.5
            the direction of a step is a guess.
    """

    values: Array
    turns: int
    largest_step: float


def unwrap(values: Array, period: float) -> Unwrapped:
    """Return a counter's values with every step the shorter way round; NaN is passed over.

    Args:
        values: shape (n,), any float type, which is kept.
        period: what the counter counts to before it starts again.
    """
    out = values.copy()
    known = np.flatnonzero(~np.isnan(values))
    if len(known) < 2:
        return Unwrapped(out, 0, 0.0)
    step = np.diff(values[known])
    turns = -np.round(step / values.dtype.type(period))
    out[known[1:]] += np.cumsum(turns) * values.dtype.type(period)
    rest = np.abs(step + turns * values.dtype.type(period))
    return Unwrapped(out, int(np.abs(turns).sum()), float(rest.max() / period))
