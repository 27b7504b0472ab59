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
from numpy.typing import NDArray

from cspm_control.allocation.closed_form import nearest_tensions
from cspm_model.kinematics import RANK_TOLERANCE
from cspm_msgs_py.errors import InputError, SingularityError

Array = NDArray[np.float64]

KEY = "control.tension_distribution.null_space"
# A pull of which less than this share is left is no new direction.
LEAST_LEFT = 1e-6


class PrescribedNullSpace:
    """t = A⁺w + N·λ with constant λ."""

    def __init__(self, coordinates: Sequence[float], structure: Array) -> None:
        """Take λ, and the design pose's structure.

        Args:
            coordinates: λ [N].
            structure: A at the design pose, shape (m, n).

        Raises:
            InputError: not as many coordinates as the null space has dimensions, or no full row
                rank at the design pose.
        """
        m, n = structure.shape
        if len(coordinates) != n - m:
            raise InputError(
                f"{KEY}: {len(coordinates)} numbers, allowed: {n - m}, the {n} cables less the"
                f" wrench's {m} controlled directions"
            )
        self._coordinates = np.array(coordinates, dtype=float)
        self._basis = null_space_basis(structure)
        self._free = np.ones(n)

    def __call__(
        self,
        structure: Array,
        wrench: Array,
        limits: Array,
        weights: Array,
        memory: Array,
        out: Array,
    ) -> int:
        """Write the tensions (n,) [N], which may be beyond the limits; return −1 without full rank.

        Raises:
            SingularityError: a direction of the null space is at right angles to all of the design
                pose's.
        """
        if not nearest_tensions(structure, wrench, np.zeros(len(out)), self._free, out):
            return -1
        inner = carried_basis(structure, self._basis) @ self._coordinates
        nearest_tensions(structure, wrench, inner, self._free, out)
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
    projected = without_wrench(structure, basis)
    squares, directions = np.linalg.eigh(projected.T @ projected)
    if len(squares) and squares[0] < LEAST_LEFT:
        raise SingularityError(
            "tension distribution: the null space has turned by 90° from that at the design pose,"
            " allowed with method prescribed: poses nearer to control.motion.design_pose"
        )
    return np.asarray(projected @ (directions / np.sqrt(squares)) @ directions.T)


def without_wrench(structure: Array, tensions: Array) -> Array:
    """Return the part of tensions (n, k) [N] that exerts no wrench by a structure (m, n)."""
    wrench = np.linalg.solve(structure @ structure.T, structure @ tensions)
    return np.asarray(tensions - structure.T @ wrench)
