"""Manipulability of the bar by its cables: one number, ellipsoids, and what gravity leaves of it.

Source: Yoshikawa, "Manipulability of Robotic Mechanisms", Int. J. Robotics Research 4 (1985), and
"Dynamic Manipulability of Robot Manipulators", J. Robotic Systems 2 (1985).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.cable_structure import CableStructure, structures, wanted_at_rest
from cspm_control.analysis.pose_grid import GRID_AXES, Grid
from cspm_control.analysis.wrench_set import all_directed, wrench_set
from cspm_model.kernels.machine import PlantParameters
from cspm_model.linearisation import mass_matrix
from cspm_model.spanned_axes import gyration_radius
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]


class Ellipsoid(NamedTuple):
    """What |t| ≤ 1 N gives in one kind of DOF.

    Attributes:
        dofs: the kind's DOFs.
        axes: directions, a column per half axis, longest first.
        lengths: of the half axes.
    """

    dofs: tuple[str, ...]
    axes: Array
    lengths: Array


class Manipulability(NamedTuple):
    """At one pose, at rest.

    Attributes:
        rank: of Jᵀ.
        measure: √det(S·Sᵀ) for moments in units of force × radius of gyration.
        condition: κ of S, thesis (6-11), and of the same scaled S.
        scaled_condition: the latter.
        force: ellipsoids of force [N per N] and moment [N·m per N].
        acceleration: of linear [m/s² per N] and angular acceleration [rad/s² per N].
        available: largest acceleration per controlled DOF, against and along its axis, from rest
            with tensions within their limits [m/s², rad/s²]; NaN where the bar cannot rest.
    """

    rank: int
    measure: float
    condition: float
    scaled_condition: float
    force: tuple[Ellipsoid, Ellipsoid]
    acceleration: tuple[Ellipsoid, Ellipsoid]
    available: dict[str, tuple[float, float]]


def measures(machine: CableStructure, structure: Array, radius: float) -> Array:
    """Return √det(S·Sᵀ), (P,), of structure matrices (P, m, n), moments over `radius`.

    NaN where they are.
    """
    found, there = np.full(len(structure), np.nan), all_directed(structure)
    scaled = _scaled(machine, structure[there], radius)
    squared = np.linalg.det(scaled @ np.swapaxes(scaled, -1, -2))
    found[there] = np.sqrt(np.maximum(squared, 0.0))
    return found


def conditions(structure: Array) -> Array:
    """Return κ of (6-11), (P,), of structure matrices (P, m, n); NaN where they are."""
    found, there = np.full(len(structure), np.nan), all_directed(structure)
    values = np.linalg.svd(structure[there], compute_uv=False)
    with np.errstate(divide="ignore"):
        found[there] = values[:, 0] / values[:, -1]
    return found


def mass_columns(machine: CableStructure, parameters: PlantParameters, grid: Grid) -> Array:
    """Return the wrench rows (P·Q, m, m) that unit accelerations of the same DOFs need [kg, …]."""
    rows = list(machine.axes)
    angles = [(pitch, yaw) for pitch in grid.pitch for yaw in grid.yaw]
    each = [mass_matrix(parameters, [0.0, 0.0, 0.0, 0.0, *pair]) for pair in angles]
    return np.tile(np.array(each)[:, rows][:, :, rows], (len(grid.positions), 1, 1))


def manipulability(
    machine: CableStructure, parameters: PlantParameters, pose: tuple[float, ...]
) -> Manipulability:
    """Return the manipulability at a pose x y z φ θ ψ, its roll taken as 0."""
    grid = _one(pose)
    structure = structures(machine, grid)
    mass = mass_columns(machine, parameters, grid)
    radius = gyration_radius(parameters)
    dofs = [DOFS[axis] for axis in machine.axes]
    return Manipulability(
        rank=len(machine.axes),
        measure=float(measures(machine, structure, radius)[0]),
        condition=float(conditions(structure)[0]),
        scaled_condition=float(conditions(_scaled(machine, structure, radius))[0]),
        force=_ellipsoids(structure[0], dofs),
        acceleration=_ellipsoids(np.linalg.solve(mass[0], structure[0]), dofs),
        available=available_accelerations(machine, parameters, pose),
    )


def available_accelerations(
    machine: CableStructure, parameters: PlantParameters, pose: Sequence[float]
) -> dict[str, tuple[float, float]]:
    """Return `Manipulability.available` at a pose x y z φ θ ψ, its roll taken as 0.

    NaN where a cable has no direction, as inside its pulley.
    """
    grid = _one(pose)
    mass = mass_columns(machine, parameters, grid)
    wanted = wanted_at_rest(machine, grid)
    wrenches = wrench_set(structures(machine, grid), machine.limits, wanted)
    found: dict[str, tuple[float, float]] = {}
    for i, axis in enumerate(machine.axes):
        against, along = (float(wrenches.reach(sign * mass[:, :, i])[0]) for sign in (-1.0, 1.0))
        found[DOFS[axis]] = (against, along)
    return found


def _one(pose: Sequence[float]) -> Grid:
    return Grid(*(np.array([pose[axis]]) for axis in GRID_AXES.values()))


def _scaled(machine: CableStructure, structure: Array, radius: float) -> Array:
    scale = np.array([1.0 if axis < 3 else 1.0 / radius for axis in machine.axes])
    return np.asarray(scale[:, None] * structure)


def _ellipsoids(gains: Array, dofs: Sequence[str]) -> tuple[Ellipsoid, Ellipsoid]:
    def of(rows: Array, names: Sequence[str]) -> Ellipsoid:
        left, lengths, _ = np.linalg.svd(rows, full_matrices=False)
        return Ellipsoid(tuple(names), left, lengths)

    linear = sum(DOFS.index(dof) < 3 for dof in dofs)
    return of(gains[:linear], dofs[:linear]), of(gains[linear:], dofs[linear:])
