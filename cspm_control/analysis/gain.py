"""Directions and couplings of a matrix of gains, thesis section 6-1: SVD and RGA."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Singular values below this share of the largest count as zero.
ZERO_SHARE = 1e-9


class Directions(NamedTuple):
    """G = U·diag(σ)·Vᴴ at one frequency, σ falling.

    Attributes:
        outputs: U, a column per direction.
        gains: σ.
        inputs: V, a column per direction.
    """

    outputs: ComplexArray
    gains: Array
    inputs: ComplexArray


def directions(gain: ComplexArray) -> Directions:
    """Return the singular value decomposition of a gain (outputs, inputs)."""
    left, values, right = np.linalg.svd(gain)
    return Directions(left, values, right.conj().T)


def singular_values(response: ComplexArray) -> Array:
    """Return σ per frequency, falling, shape (m, k), of a response (m, outputs, inputs)."""
    return np.asarray(np.linalg.svd(response, compute_uv=False))


def relative_gains(response: ComplexArray) -> ComplexArray:
    """Return the relative gain array G∘(G⁺)ᵀ of each response (m, outputs, inputs).

    Source: Skogestad, Postlethwaite, Multivariable Feedback Control (2005), section 3.4 and A.4.2.
    """
    inverse = np.linalg.pinv(response, rcond=ZERO_SHARE)
    return np.asarray(response * np.swapaxes(inverse, -1, -2))


def condition(gains: Array) -> float:
    """Return the largest over the smallest σ that is not zero, for falling σ (k,)."""
    return float(gains[0] / gains[gains > ZERO_SHARE * gains[0]][-1])
