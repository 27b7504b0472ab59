"""How long a block must be so that blocks are nearly independent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def block_length(series: Sequence[Array]) -> int:
    """Return the block length [samples] that the moving-block bootstrap of a mean wants.

    Politis and White, Econometric Reviews 23(1), 2004, with the correction of Patton, Politis and
    White, 28(4), 2009, at autocovariances that are summed over the pieces.

    Args:
        series: pieces of one process, each of shape (n,).
    """
    total = sum(map(len, series))
    longest = max(map(len, series))
    run = max(5, int(np.sqrt(np.log10(total))))
    lags = min(int(np.ceil(np.sqrt(total))) + run, longest - 1)
    covariance = autocovariances(series, lags)
    if lags < 1 or covariance[0] <= 0.0:
        return 1
    limit = 2.0 * np.sqrt(np.log10(total) / total)
    small = np.abs(covariance[1:] / covariance[0]) < limit
    m = _first_run(small, run)
    bandwidth = min(2 * max(m, 1), lags)
    k = np.arange(1, bandwidth + 1)
    window = np.minimum(1.0, 2.0 * (1.0 - k / bandwidth))  # trapezoid
    g = 2.0 * float(np.sum(window * k * covariance[1 : bandwidth + 1]))
    spectrum = covariance[0] + 2.0 * float(np.sum(window * covariance[1 : bandwidth + 1]))
    if spectrum <= 0.0:
        return 1
    best = (2.0 * g**2 / (4.0 / 3.0 * spectrum**2)) ** (1.0 / 3.0) * total ** (1.0 / 3.0)
    return int(np.clip(np.ceil(best), 1, max(1, min(3.0 * np.sqrt(total), total / 3.0, longest))))


def autocovariances(series: Sequence[Array], lags: int) -> Array:
    """Return the autocovariances at lags 0 to `lags` about the common mean, shape (lags + 1,)."""
    total = sum(map(len, series))
    mean = sum(float(piece.sum()) for piece in series) / total
    sums = np.zeros(lags + 1)
    for piece in series:
        centred = piece - mean
        size = 1 << int(2 * len(piece) - 1).bit_length()
        spectrum = np.fft.rfft(centred, size)
        found = np.fft.irfft(spectrum * spectrum.conj(), size)[: min(lags + 1, len(piece))]
        sums[: len(found)] += found
    return sums / total


def _first_run(small: NDArray[np.bool_], run: int) -> int:
    """Lag before the first `run` negligible lags in a row; the last lag if there are none."""
    if len(small) < run:
        return len(small)
    together = np.convolve(small, np.ones(run, dtype=int), "valid") == run
    found = np.flatnonzero(together)
    return int(found[0]) if len(found) else len(small)
