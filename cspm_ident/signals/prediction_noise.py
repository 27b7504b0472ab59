"""The noise of readings whose stamps need not be even."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.samples import Samples

Array = NDArray[np.float64]

# Neighbours from which a reading is predicted, two on each side: a cubic.
_NEIGHBOURS = (-2, -1, 1, 2)


def prediction_noise(samples: Samples) -> float:
    """Return the variance of what a cubic through two neighbours on each side does not predict.

    The cubic is taken at the samples' own stamps, so that true stamps may be irregular, while wrong
    ones count as noise. The prediction's own share is taken out.

    Args:
        samples: of one column.
    """
    squares, count = 0.0, 0
    for span in samples.spans:
        times, values = samples.times[span], samples.values[span][:, 0]
        if len(times) < len(_NEIGHBOURS) + 1:
            continue
        middle = np.arange(2, len(times) - 2)
        apart = np.stack([times[middle + k] - times[middle] for k in _NEIGHBOURS])
        weights = np.stack([_lagrange(apart, k) for k in range(len(_NEIGHBOURS))])
        near = np.stack([values[middle + k] for k in _NEIGHBOURS]) - values[middle]
        left = np.sum(weights * near, axis=0)
        squares += float(np.sum(left**2 / (1.0 + np.sum(weights**2, axis=0))))
        count += len(middle)
    return squares / max(count, 1)


def _lagrange(apart: Array, which: int) -> Array:
    """Return the weight at 0 of the cubic's neighbour at `apart[which]`, (n,)."""
    others = np.delete(apart, which, axis=0)
    return np.asarray(np.prod(-others / (apart[which] - others), axis=0))
