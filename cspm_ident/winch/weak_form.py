"""The winch equation under a window that moves along the signals: no differentiated noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_POWER = 4
# Of windows along a winch's signals.
HALF_WIDTH_S = 0.02


class Window(NamedTuple):
    """A smooth window, and what makes of a signal its weighted second derivative.

    The derivative consists of differences of the window itself, so that summation by parts is
    exact: straight lines weigh nothing.

    Attributes:
        weights: φ, sums to 1, shape (w,).
        second: φ″ [1/s²], shape (w,).
    """

    weights: Array
    second: Array

    def averaged(self, step: float) -> Array:
        """Return weights of what is read at instants and acts all the time between, shape (w,).

        A second difference of angles is the acceleration averaged over a step before and one after;
        so is what a drive holds. That of readings is taken to fourth order (Numerov).
        """
        return self.weights + step**2 / 12.0 * self.second


def make_window(half_width: int, step: float) -> Window:
    """Return φ = (1 − s²)⁴ on −1 < s < 1 (Messenger and Bortz, SIAM MMS 19(3), 2021).

    Args:
        half_width: samples from its middle to where it becomes zero, at least 2.
        step: time between samples [s].
    """
    s = np.arange(-half_width - 1, half_width + 2) / half_width
    window = np.where(np.abs(s) < 1.0, (1.0 - s**2), 0.0) ** _POWER
    window /= window.sum()
    return Window(
        window[1:-1],
        (window[2:] - 2.0 * window[1:-1] + window[:-2]) / step**2,
    )


def first_of(half_width: int, step: float) -> Array:
    """Return −φ′ of `make_window` [1/s], shape (w,), which makes of a signal its weighted rate.

    Central differences of the window, so that summation by parts is exact.

    Args:
        half_width: see `make_window`.
        step: time between samples [s].
    """
    s = np.arange(-half_width - 1, half_width + 2) / half_width
    window = np.where(np.abs(s) < 1.0, (1.0 - s**2), 0.0) ** _POWER
    window /= window.sum()
    return np.asarray((window[:-2] - window[2:]) / (2.0 * step))


def weigh(weights: Array, values: Array, stride: int) -> Array:
    """Return Σ weights·values at every stride-th place where the window fits.

    Args:
        weights: of a window, shape (w,).
        values: shape (n, …), n ≥ w.
        stride: samples between places.
    """
    windows = np.lib.stride_tricks.sliding_window_view(values, len(weights), axis=0)[::stride]
    return np.asarray(windows @ weights)
