"""What wrenches, and so what accelerations, cables within their limits can give.

The wrenches S·t with tensions in [low, high] fill a zonotope; each of its facets spans m − 1
columns of S that it is parallel to. A wrench is within where it is on the inner side of all.

Source: Bouchard, Gosselin, Moore, "On the Ability of a Cable-Driven Robot to Generate a Prescribed
Set of Wrenches", J. Mechanisms Robotics 2 (2010); Gouttefarde, Krut, "Characterization of Parallel
Manipulator Available Wrench Set Facets", Advances in Robot Kinematics (2010).
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Columns whose normal is shorter than this are parallel: they span no facet.
SHORTEST_NORMAL = 1e-9


class WrenchSet(NamedTuple):
    """The wrenches that cables can give, at P poses, beyond what is wanted of them at rest.

    Attributes:
        normals: of K facets, outward, (P, K, m); zero where there is no facet.
        room: how far rest is within each facet, along its normal, (P, K); −inf where a cable has
            no direction.
    """

    normals: Array
    room: Array

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Whether the cables can hold the bar at rest, (P,)."""
        return np.asarray((self.room >= 0.0).all(axis=1))

    def reach(self, directions: Array) -> Array:
        """Return how many times a wrench (P, m) can be added, (P,); NaN where rest is not held."""
        along = np.einsum("pkm,pm->pk", self.normals, directions)
        return self._most(along)

    def factor(self, edges: Array) -> Array:
        """Return how large a box of wrenches fits around rest, (P,); NaN where rest is not held.

        Args:
            edges: the box's half edges, each a wrench, (P, m, k); the factor scales all of them.
        """
        along = np.abs(np.einsum("pkm,pme->pke", self.normals, edges)).sum(axis=2)
        return self._most(along)

    def _most(self, along: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            factors = np.where(along > 0.0, self.room / along, np.inf)
        return np.where(self.holds, factors.min(axis=1), np.nan)


def all_directed(structure: Array) -> NDArray[np.bool_]:
    """Return at which poses of (P, m, n) all cables have a direction, (P,); the others are NaN."""
    return np.asarray(~np.isnan(structure).any(axis=(1, 2)))


def wrench_set(structure: Array, limits: ArrayLike, wanted: Array) -> WrenchSet:
    """Return the wrench sets of structure matrices.

    Args:
        structure: −Jᵀ, (P, m, n); poses with NaN give no wrench.
        limits: tensions (n, 2) [N].
        wanted: of the cables at rest, (P, m) [N, N·m].
    """
    low, high = np.asarray(limits, dtype=float).T
    directed = all_directed(structure)
    structure = np.where(directed[:, None, None], structure, 0.0)
    half = _normals(structure)
    normals = np.concatenate([half, -half], axis=1)
    pulls = np.einsum("pkm,pmn->pkn", normals, structure)
    farthest = np.maximum(low * pulls, high * pulls).sum(axis=2)
    room = farthest - np.einsum("pkm,pm->pk", normals, wanted)
    # A set of parallel columns bounds nothing; round-off would make it a narrow slit.
    room[~normals.any(axis=2)] = np.inf
    room[~directed] = -np.inf
    return WrenchSet(normals, room)


def _normals(structure: Array) -> Array:
    """Return unit normals of all m − 1 columns, (P, K, m), by the generalised cross product."""
    m, n = structure.shape[1:]
    chosen = np.array(list(combinations(range(n), m - 1)))
    columns = np.moveaxis(structure[:, :, chosen], 2, 1)
    rows = np.arange(m)
    out = np.stack(
        [(-1.0) ** row * np.linalg.det(columns[:, :, rows != row, :]) for row in rows], axis=-1
    )
    length = np.linalg.norm(out, axis=-1, keepdims=True)
    found = length > SHORTEST_NORMAL
    return np.where(found, out / np.where(found, length, 1.0), 0.0)
