"""Windows that weight the residuals of cables and bar, as wide as their noise requires."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.winch.weak_form import make_window, weigh
from cspm_model.robust_statistics import difference_noise

Array = NDArray[np.float64]

# Windows pass frequencies well within the band of the smoothed poses. They are doubled while that
# reduces the noise by more than it would reduce white noise: most noise is then above their band.
_HALF_WIDTHS = (0.04, 0.32)
_WHITE = 1.7


def quiet_window(residuals: Array, band: float | None, step: float) -> tuple[Array, int]:
    """Return a window's weights and the number of rows between two windows.

    Args:
        residuals: to be weighted, shape (k, m).
        band: of the smoothed poses [Hz]; None: the shortest window, whatever the noise.
        step: between rows [s].
    """
    if band is None:
        return _window(_HALF_WIDTHS[0], step)
    half_s, most = float(np.clip(2.0 / band, *_HALF_WIDTHS)), _HALF_WIDTHS[1]
    found = _window(half_s, step)
    noise = difference_noise(weigh(found[0], residuals, found[1]))
    while 2.0 * half_s <= most:
        wider = _window(2.0 * half_s, step)
        less = difference_noise(weigh(wider[0], residuals, wider[1]))
        if np.median(noise / np.maximum(less, 1e-300)) <= _WHITE:
            break
        half_s, found, noise = 2.0 * half_s, wider, less
    return found


def _window(half_s: float, step: float) -> tuple[Array, int]:
    half = max(2, round(half_s / step))
    return make_window(half, step).weights, max(1, half // 2)
