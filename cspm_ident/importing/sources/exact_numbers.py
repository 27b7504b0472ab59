"""Numbers of a column without rounding: counters of 64 bits among them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_ALL_WHOLE, _LARGEST = 2.0**53, 2.0**64
"""Up to where float64 holds every whole number, and counters of 64 bits go."""


def exact_numbers(values: ArrayLike) -> NDArray[Any]:
    """Return numbers as float64, or as longdouble where that would round whole ones; None is NaN.

    Raises:
        TypeError, ValueError, OverflowError: they are no numbers.
    """
    found = np.asarray(values, dtype=np.float64)
    if not may_be_rounded(found) or _is_double(values):
        return found
    return np.asarray(values, dtype=np.longdouble)


def _is_double(values: ArrayLike) -> bool:
    if isinstance(values, np.ndarray):
        return bool(values.dtype.kind == "f" and values.dtype.itemsize <= 8)
    return all(one is None or isinstance(one, float) for one in np.ravel(np.asarray(values, "O")))


def may_be_rounded(values: NDArray[np.float64]) -> bool:
    """Return whether some of these may be whole numbers that float64 has rounded."""
    return spacing_of(values) > 1.0


def spacing_of(values: NDArray[Any]) -> float:
    """Return the distance of whole numbers of up to 64 bits in float64 where they are largest.

    Args:
        values: float64, shape (n,).
    """
    size = np.abs(values)
    size = size[(size >= _ALL_WHOLE) & (size <= _LARGEST)]
    return float(np.spacing(size.max())) if len(size) else 1.0
