"""What a reference asks of the machine before anything runs: wrench, tensions, speeds, torques."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.allocation.analytic_centre import analytic_centre
from cspm_control.allocation.tension_distribution import RESIDUAL_TOLERANCE
from cspm_control.analysis.wrench_set import wrench_set
from cspm_control.controllers.bar_dynamics import INERTIA as INERTIA_TENSOR
from cspm_control.controllers.bar_dynamics import MASS
from cspm_control.controllers.governor import Governed, demand_along
from cspm_control.feedforward.winch_feedforward import winding_accelerations
from cspm_model.kernels.cable import INERTIA, RADIUS
from cspm_model.kernels.rows import reference_row
from cspm_model.kinematics import geometry
from cspm_model.motion import Motion
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]


class ReferenceDemand(NamedTuple):
    """What a reference needs at k instants.

    Attributes:
        times: (k,) [s].
        tensions: amid the limits where the wrench can be met, else of the nearest wrench, (k, n)
            [N].
        missing: of the wrench in the controlled axes, (k, m) [N, N·m].
        met: whether tensions within the limits give the wrench, (k,).
        speeds: of the motor shafts, positive winds in, (k, n) [rad/s].
        torques: at the motor shafts for tension and inertia, (k, n) [N·m].
        worst: when [s] and in which coordinate most of the wrench is missing, moments over the
            bar's radius of gyration; None where all is met.
    """

    times: Array
    tensions: Array
    missing: Array
    met: NDArray[np.bool_]
    speeds: Array
    torques: Array
    worst: tuple[float, str] | None


def reference_demand(
    machine: Governed, bar: Motion, frame: Motion, duration: float, spacing: float
) -> ReferenceDemand:
    """Return what a reference needs, if bar and cables follow it exactly.

    Args:
        machine: whose tensions are limited.
        bar: its reference.
        frame: the winch frame's motion.
        duration: of the run [s].
        spacing: time between instants [s].
    """
    times: Array = spacing * np.arange(round(duration / spacing) + 1, dtype=np.float64)
    motion = np.array([bar.at(time) for time in times])
    frames = np.array([frame.at(time) for time in times])
    return demand_of(machine, times, motion, frames)


def demand_of(machine: Governed, times: Array, motion: Array, frames: Array) -> ReferenceDemand:
    """Return what poses and derivatives of bar and winch frame (k, 18) need at `times` (k,) [s]."""
    tensions, missing, met = _tensions(machine, motion, frames)
    speeds, torques = _shafts(machine.cables, motion, frames, tensions)
    worst = None if met.all() else _worst(machine, times, np.where(met[:, None], 0.0, missing))
    return ReferenceDemand(times, tensions, missing, met, speeds, torques, worst)


def first_unmet(
    machine: Governed, bar: Motion, frame: Motion, duration: float, count: int
) -> float | None:
    """Return the first of `count` instants at which no tensions give the wrench [s], else None.

    By the facets of the wrench sets alone, so that a run need not compile a distribution for it.
    """
    times = np.linspace(0.0, duration, count)
    motion, frames = (np.array([each.at(time) for time in times]) for each in (bar, frame))
    demand = demand_along(machine, motion, frames[:, :6])
    met = wrench_set(demand.structure, machine.limits, demand.wrench).holds
    return None if met.all() else float(times[int(np.argmin(met))])


def _tensions(
    machine: Governed, motion: Array, frames: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return tensions (k, n), what they miss of the wrench (k, m), and whether they meet it."""
    demand = demand_along(machine, motion, frames[:, :6])
    weights, none = 1.0 / _units(machine) ** 2, np.zeros(0)
    tensions = np.empty((len(motion), len(machine.cables)))
    for structure, wrench, out in zip(demand.structure, demand.wrench, tensions, strict=True):
        analytic_centre(structure, wrench, machine.limits, weights, none, out)
    missing = demand.wrench - np.einsum("kmn,kn->km", demand.structure, tensions)
    size = np.linalg.norm(demand.wrench, axis=1)
    return tensions, missing, np.linalg.norm(missing, axis=1) <= RESIDUAL_TOLERANCE * size


def _units(machine: Governed) -> Array:
    """Return what a unit of force or moment counts in each axis: moments over the radius."""
    inertia = machine.bar[INERTIA_TENSOR : INERTIA_TENSOR + 9].reshape(3, 3)
    radius = np.sqrt(np.trace(inertia) / (2.0 * machine.bar[MASS]))
    return np.array([1.0 if axis < 3 else radius for axis in machine.axes])


def _worst(machine: Governed, times: Array, missing: Array) -> tuple[float, str]:
    """Return when most is missing, and in which coordinate."""
    scaled = np.abs(missing) / _units(machine)
    k, axis = np.unravel_index(int(scaled.argmax()), scaled.shape)
    return float(times[k]), DOFS[machine.axes[axis]]


def _shafts(cables: Array, motion: Array, frames: Array, tensions: Array) -> tuple[Array, Array]:
    """Return speeds [rad/s] and torques [N·m] of the motor shafts, (k, n) each."""
    radius, inertia = cables[:, RADIUS], cables[:, INERTIA]
    rows, lengths, winding = np.empty((2, 19)), np.empty(len(cables)), np.empty(len(cables))
    speeds, torques = np.empty(tensions.shape), np.empty(tensions.shape)
    for k, (body, base) in enumerate(zip(motion, frames, strict=True)):
        reference_row(body, rows[0])
        reference_row(base, rows[1])
        found = geometry(cables, body[:6], base[:6])
        speeds[k] = -(found.bar @ rows[0, 7:13] + found.frame @ rows[1, 7:13]) / radius
        winding_accelerations(cables, rows[0], rows[1], lengths, winding)
        torques[k] = radius * tensions[k] + inertia * winding / radius
    return speeds, torques
