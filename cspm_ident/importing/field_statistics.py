"""Range, mean and scatter of a channel of any length."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.value_suspicions import SAMPLE
from cspm_ident.importing.column_store import pieces

Array = NDArray[np.float64]


class FieldStatistics(NamedTuple):
    """What the numbers of a channel are like [SI]; NaN where there is none.

    Attributes:
        low: least value.
        high: largest value.
        mean: mean value.
        deviation: standard deviation.
        head: the first values that are numbers, for what a sample can show.
    """

    low: float
    high: float
    mean: float
    deviation: float
    head: Array


def statistics_of(values: Callable[[slice], Array], count: int) -> FieldStatistics:
    """Return the statistics of a channel, read piece by piece.

    Means and squares of pieces are joined by the pairwise formula of Chan, Golub and LeVeque
    (1983), which loses no digits.

    Args:
        values: returns a slice of the channel, NaN where there is no number.
        count: number of values.
    """
    low, high, mean, squares, known, head = np.inf, -np.inf, 0.0, 0.0, 0, np.zeros(0)
    for piece in pieces(count):
        some = values(piece)
        some = some[~np.isnan(some)]
        if not len(some):
            continue
        head = np.concatenate([head, some[: SAMPLE - len(head)]])
        low, high = min(low, float(some.min())), max(high, float(some.max()))
        total, apart = known + len(some), float(some.mean()) - mean
        squares += len(some) * float(some.var()) + apart**2 * known * len(some) / total
        mean, known = mean + apart * len(some) / total, total
    if not known:
        return FieldStatistics(np.nan, np.nan, np.nan, np.nan, head)
    return FieldStatistics(low, high, mean, float(np.sqrt(squares / known)), head)
