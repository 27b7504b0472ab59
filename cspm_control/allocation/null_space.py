"""Tensions with a prescribed part that exerts no wrench: t = A⁺w + N·λ, thesis (5-7).

A = −Jᵀ in the controlled axes, shape (m, n). The columns of N, shape (n, n − m), are an orthonormal
basis of its null space. Which basis is a choice; here it is this one:

- At the design pose, cable by cable in the machine's order, the tensions without wrench nearest to
  a pull of that cable alone, made orthogonal to those before (Gram-Schmidt); what is no new
  direction is left out. So the first entry of a column that is not zero is positive.
- Elsewhere the orthonormal basis nearest to that one (its projection's polar factor). It depends on
  the pose alone, not on the way there, and turns as steadily as the cables do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.closed_form import nearest_tensions
from cspm_model.kinematics import RANK_TOLERANCE
from cspm_msgs_py.errors import InputError, SingularityError

Array = NDArray[np.float64]

KEY = "control.tension_distribution.null_space"
# A pull of which less than this share is left is no new direction.
LEAST_LEFT = 1e-6
# What `prescribed` returns where the null space has turned away, and what is said then.
TURNED = -2
TURNED_TEXT = (
    "tension distribution: the null space has turned by 90° from that at the design pose,"
    " allowed with method prescribed: poses nearer to control.motion.design_pose"
)


def prescribed_memory(coordinates: Sequence[float], structure: Array) -> Array:
    """Return what `prescribed` remembers: λ, and the basis at the design pose row by row.

    Args:
        coordinates: λ [N].
        structure: A at the design pose, shape (m, n).

    Raises:
        InputError: not as many coordinates as the null space has dimensions, or no full row rank
            at the design pose.
    """
    m, n = structure.shape
    if len(coordinates) != n - m:
        raise InputError(
            f"{KEY}: {len(coordinates)} numbers, allowed: {n - m}, the {n} cables less the"
            f" wrench's {m} controlled directions"
        )
    return np.concatenate(
        [np.array(coordinates, dtype=float), null_space_basis(structure).T.ravel()]
    )


@njit(cache=True, error_model="numpy")
def prescribed(
    structure: Array, wrench: Array, limits: Array, weights: Array, memory: Array, out: Array
) -> int:
    """Write the tensions t = A⁺w + N·λ (n,) [N], which may be beyond the limits.

    Returns −1 without full rank, `TURNED` where a direction of the null space is at right angles to
    all of the design pose's.
    """
    m, n = structure.shape
    k = n - m
    if not nearest_tensions(structure, wrench, np.zeros(n), np.ones(n), out):
        return -1
    basis = np.empty((k, n))
    if not _carried(structure, memory[k:].reshape((k, n)), basis):
        return TURNED
    inner = np.zeros(n)
    for j in range(k):
        for i in range(n):
            inner[i] += basis[j, i] * memory[j]
    nearest_tensions(structure, wrench, inner, np.ones(n), out)
    return 0


def null_space_basis(structure: Array) -> Array:
    """Return the basis N, (n, n − m), of a structure's null space at the design pose.

    Args:
        structure: A, shape (m, n).

    Raises:
        InputError: A has no full row rank.
    """
    m, n = structure.shape
    if np.linalg.matrix_rank(structure, rtol=RANK_TOLERANCE) < m:
        raise InputError(
            "control.motion.design_pose: the cables do not span the wrench's controlled directions"
            f" there, allowed with method prescribed: a pose at which they span all {m}"
        )
    columns: list[Array] = []
    for pull in without_wrench(structure, np.eye(n)).T:
        rest = pull.copy()
        # The second time takes off what rounding left of the first.
        for column in columns + columns:
            rest -= (column @ rest) * column
        length = float(np.linalg.norm(rest))
        if length > LEAST_LEFT and len(columns) < n - m:
            columns.append(rest / length)
    return np.array(columns).reshape(n - m, n).T


def carried_basis(structure: Array, basis: Array) -> Array:
    """Return the orthonormal basis of a structure's null space that is nearest to another basis.

    Args:
        structure: A of full row rank, shape (m, n).
        basis: orthonormal columns, shape (n, n − m).

    Raises:
        SingularityError: a direction of the null space is at right angles to all of `basis`.
    """
    found = np.empty(basis.T.shape)
    if not _carried(structure, np.ascontiguousarray(basis.T), found):
        raise SingularityError(TURNED_TEXT)
    return found.T


@njit(cache=True, error_model="numpy")
def _carried(structure: Array, rows: Array, out: Array) -> bool:
    """Write the basis nearest to another, directions in rows (k, n); False where there is none."""
    k, n = rows.shape
    if k == 0:
        return True
    projected, still = np.empty((k, n)), np.zeros(structure.shape[0])
    for j in range(k):
        nearest_tensions(structure, still, rows[j], np.ones(n), projected[j])
    squares, directions = np.linalg.eigh(projected @ np.ascontiguousarray(projected.T))
    if squares[0] < LEAST_LEFT:
        return False
    # The polar factor: what is left, times the inverse root of its squares.
    scaled = directions / np.sqrt(squares)
    out[:] = np.ascontiguousarray(scaled) @ np.ascontiguousarray(directions.T) @ projected
    return True


def without_wrench(structure: Array, tensions: Array) -> Array:
    """Return the part of tensions (n, k) [N] that exerts no wrench by a structure (m, n)."""
    wrench = np.linalg.solve(structure @ structure.T, structure @ tensions)
    return np.asarray(tensions - structure.T @ wrench)
