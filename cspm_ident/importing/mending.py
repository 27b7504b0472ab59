"""Impossible samples of a channel taken out or put right, where the mapping asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_checks.outliers import find_outliers
from cspm_ident.importing.mapping import ChannelSource
from cspm_ident.importing.time_base import Times

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mended:
    """What was changed in a channel.

    Attributes:
        masked: rows that are NaN now.
        joined: first rows after a jump that was taken out.
        sizes: of those jumps [SI].
    """

    masked: NDArray[np.intp]
    joined: NDArray[np.intp]
    sizes: Array


def mend(values: Array, times: Times, source: ChannelSource) -> tuple[Array, Mended | None]:
    """Return a channel as the mapping wants it mended, and what was changed, None if nothing.

    Args:
        values: in SI, shape (n,).
        times: of its rows.
        source: says whether spikes are masked and jumps joined.
    """
    found, rows = find_outliers(values, times.stamp_ns)
    out = values.copy()
    masked = np.sort(np.concatenate([found.spikes, found.zeros]))
    masked = rows[masked] if source.spikes == "mask" else rows[:0]
    out[masked] = np.nan
    joined, sizes = rows[:0], np.zeros(0)
    if source.jumps == "join" and found.period is None:
        joined, sizes = rows[found.jumps], found.sizes
        for row, size in zip(joined.tolist(), sizes.tolist(), strict=True):
            out[row:] -= size
    return out, Mended(masked, joined, sizes) if len(masked) or len(joined) else None
