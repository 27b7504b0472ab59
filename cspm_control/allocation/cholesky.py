"""Small symmetric systems, solved within compiled kernels.

A library's solver would do the same; compiling the call to it takes seconds of every first run.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A pivot below this share of its diagonal is round-off: the matrix is singular.
SMALLEST_PIVOT = 1e-12


@njit(cache=True, error_model="numpy")
def factorise(matrix: Array) -> bool:
    """Replace the lower triangle of a symmetric matrix by its Cholesky factor.

    Returns False, with the matrix spoilt, where it is not positive definite beyond round-off.
    """
    for i in range(matrix.shape[0]):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            if i == j:
                if not rest > SMALLEST_PIVOT * matrix[i, i]:
                    return False
                matrix[i, i] = np.sqrt(rest)
            else:
                matrix[i, j] = rest / matrix[j, j]
    return True


@njit(cache=True, error_model="numpy")
def substitute(factor: Array, values: Array) -> None:
    """Solve L·Lᵀ·y = b in place for the factor L in the lower triangle."""
    m = values.shape[0]
    for i in range(m):
        for k in range(i):
            values[i] -= factor[i, k] * values[k]
        values[i] /= factor[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            values[i] -= factor[k, i] * values[k]
        values[i] /= factor[i, i]


@njit(cache=True, error_model="numpy")
def solve_gram(rows: Array, wanted: Array) -> bool:
    """Solve (A·Aᵀ)·y = w for A = `rows` (m, n), y left in `wanted`.

    Returns False, with nothing solved, where A has no full row rank.
    """
    m = rows.shape[0]
    gram = np.empty((m, m))
    for i in range(m):
        for j in range(i + 1):
            gram[i, j] = 0.0
            for k in range(rows.shape[1]):
                gram[i, j] += rows[i, k] * rows[j, k]
    if not factorise(gram):
        return False
    substitute(gram, wanted)
    return True
