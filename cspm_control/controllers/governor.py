"""A reference governor with preview: how a bar is to leave a reference that no tensions can give.

A bar on cables that only pull cannot be given every acceleration at every place. If it follows its
reference until there, it falls behind; if it is known beforehand, the bar takes a run-up. The least
deviation is a quadratic programme over time with the tensions as inputs: the model predictive form
of a reference governor (Garone, Di Cairano, Kolmanovsky, Automatica 75, 2017), solved by an
interior-point method (Clarabel).
"""

from __future__ import annotations

from typing import NamedTuple

import clarabel
import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_control.allocation.analytic_centre import analytic_centre
from cspm_control.allocation.tension_distribution import RESIDUAL_TOLERANCE
from cspm_control.controllers.bar_dynamics import wrench_for
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.motion import Motion
from cspm_msgs_py.errors import ConvergenceError

Array = NDArray[np.float64]

# Time between knots [s], a fortieth of the fastest wave's period.
SPACING = 0.02
# The programme is linear about a plan, and solved anew about the result until nothing moves by more
# than this share of the tolerances.
SETTLED, MOST_ROUNDS = 0.02, 6
# What a change of the acceleration from knot to knot, by one limit per knot squared, counts beside
# a deviation of one limit; and a tension of 1 N. Without the first, tensions jump from limit to
# limit faster than force controllers follow; the second makes tensions unique.
SMOOTH, LIGHT = 100.0, 1e-9
# A deviation within this many tolerances leaves room for what the control adds.
ROOM = 0.8


class Governed(NamedTuple):
    """The machine that is planned for.

    Attributes:
        cables: the plant's cable rows.
        bar: kernel parameters of the bar.
        limits: of the planned tensions (n, 2) [N].
        axes: world axes in which the wrench is to be met, which are the coordinates that deviate.
        tolerances: what deviations count against, (6,) [m, rad].
        known_wrench: constant wrench on the bar from outside, (6,) [N, N·m], in world_ned.
    """

    cables: Array
    bar: Array
    limits: Array
    axes: tuple[int, ...]
    tolerances: Array
    known_wrench: Array


class Demand(NamedTuple):
    """At each of k knots: wrench = structure·tensions is wanted, and mass per acceleration."""

    structure: Array
    wrench: Array
    mass: Array


def plan_deviation(
    machine: Governed,
    bar: Motion,
    frame: Motion,
    duration: float,
    preview: float,
    excess_weight: float = 0.0,
) -> Motion:
    """Return by how much the bar is to be where its reference is not, x y z φ θ ψ over time.

    It is zero but from `preview` before to `preview` after each instant at which no tensions within
    the limits give the reference's acceleration. Stretches that touch are planned as one. What is
    least is the sum of half the squared deviations in tolerances and of `excess_weight` times the
    largest excess over the tolerances of each knot, as a soft constraint with an exact penalty
    (Kerrigan, Maciejowski, UKACC Control 2000): a deviation that cannot be avoided is then
    gathered in few knots, first in those whose reference not even tensions from 0 N on can give.

    Args:
        machine: what is planned for.
        bar: its reference.
        frame: the winch frame's motion.
        duration: of the plan [s].
        preview: how far ahead both are known [s].
        excess_weight: of a tolerance too much where the reference is possible at all, ≥ 0.

    Raises:
        ConvergenceError: a plan was not found.
    """
    times = SPACING * np.arange(round(duration / SPACING) + 2)
    wanted = np.array([bar.at(time) for time in times])
    frames = np.array([frame.at(time)[:6] for time in times])
    deviation = np.zeros((len(times), 18))
    blocked = _blocked(machine, wanted, frames)
    excess = np.where(_impossible(machine, wanted, frames, blocked), 0.0, excess_weight)
    for window in _windows(blocked, round(preview / SPACING)):
        ends = window.start == 0, window.stop == len(times)
        for _ in range(MOST_ROUNDS):
            before = deviation[window].copy()
            demand = demand_along(machine, wanted[window] + before, frames[window])
            deviation[window] = _least_deviation(machine, demand, before, ends, excess[window])
            if (np.abs(deviation[window] - before)[:, :6] < SETTLED * machine.tolerances).all():
                break
    return Motion(deviation, SPACING)


def _blocked(machine: Governed, wanted: Array, frames: Array) -> NDArray[np.bool_]:
    """Return at which knots no tensions within the limits give the reference's acceleration."""
    demand = demand_along(machine, wanted, frames)
    weights, tensions = np.ones(len(machine.axes)), np.empty(len(machine.cables))
    # Each knot for itself, whatever the one before.
    none = np.zeros(0)
    blocked = np.empty(len(wanted), dtype=bool)
    for k, (structure, wrench) in enumerate(zip(demand.structure, demand.wrench, strict=True)):
        analytic_centre(structure, wrench, machine.limits, weights, none, tensions)
        missing = np.linalg.norm(structure @ tensions - wrench)
        blocked[k] = missing > RESIDUAL_TOLERANCE * np.linalg.norm(wrench)
    return blocked


def _impossible(
    machine: Governed, wanted: Array, frames: Array, blocked: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return at which of the blocked knots no tensions from 0 N on would do either."""
    limits = machine.limits.copy()
    limits[:, 0] = 0.0
    found = blocked.copy()
    found[blocked] = _blocked(machine._replace(limits=limits), wanted[blocked], frames[blocked])
    return found


def _windows(blocked: NDArray[np.bool_], reach: int) -> list[slice]:
    """Return the stretches within `reach` knots of a blocked one."""
    near = np.convolve(blocked, np.ones(2 * reach + 1))[reach : reach + len(blocked)] > 0.5
    edges = np.flatnonzero(np.diff(near.astype(int), prepend=0, append=0))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def demand_along(machine: Governed, motion: Array, frames: Array) -> Demand:
    """Return what motion rows (k, 18) require at the winch frame's poses (k, 6)."""
    axes, n = list(machine.axes), len(machine.cables)
    count, m = len(motion), len(axes)
    found = Demand(np.empty((count, m, n)), np.empty((count, m)), np.empty((count, m, m)))
    lengths, jacobians, wrench, more = np.empty(n), np.empty((2, n, 6)), np.empty(6), np.empty(6)
    for k, row in enumerate(motion):
        pose, rate, acceleration = row.reshape(3, 6)
        cable_geometry(machine.cables, pose, frames[k], lengths, jacobians[0], jacobians[1])
        found.structure[k] = -jacobians[0].T[axes]
        wrench_for(pose, rate, acceleration, machine.bar, wrench)
        found.wrench[k] = (wrench - machine.known_wrench)[axes]
        for column, axis in enumerate(axes):
            unit = acceleration.copy()
            unit[axis] += 1.0
            wrench_for(pose, rate, unit, machine.bar, more)
            found.mass[k, :, column] = (more - wrench)[axes]
    return found


def _least_deviation(
    machine: Governed, demand: Demand, planned: Array, ends: tuple[bool, bool], excess: Array
) -> Array:
    """Return the deviation rows (k, 18) nearest to zero that tensions within the limits can give.

    `demand` is linear about the rows planned so far; `ends` says where the window begins or ends
    with the plan, so that the bar need not be on its reference there; `excess` (k,) weighs what is
    beyond the tolerances at each knot.
    """
    count, m, n = demand.structure.shape
    axes, size = np.array(machine.axes), count * m
    tolerance = machine.tolerances[axes]
    # In limits, and limits per knot and per knot squared: numbers of one size.
    scales = [tolerance, tolerance / SPACING, tolerance / SPACING**2]
    counted = np.flatnonzero(excess)
    wrenches, right = _wrenches(demand, planned[:, 12 + axes], scales[2])
    equal = scipy.sparse.vstack([_integration(count, m, n), _at_ends(count, m, n, ends), wrenches])
    unequal, most = _bounds(machine.limits, count, m, counted)
    linear = np.concatenate([np.zeros(equal.shape[1]), excess[counted]])
    equal = scipy.sparse.hstack([equal, scipy.sparse.csc_matrix((equal.shape[0], len(counted)))])
    zeros = np.zeros(equal.shape[0] - size)
    right = np.concatenate([zeros, right])
    solution = _solve(_cost(count, m, n, len(counted)), linear, (equal, right), (unequal, most))
    rows = np.zeros((count, 18))
    for order in range(3):
        part = solution[order * size : (order + 1) * size].reshape(count, m)
        rows[:, 6 * order + axes] = part * scales[order]
    return rows


def _cost(count: int, m: int, n: int, counted: int) -> scipy.sparse.spmatrix:
    """Return what squares cost: of deviations, their changes of acceleration, and tensions."""
    size = count * m
    change = scipy.sparse.eye(count - 1, count, k=1) - scipy.sparse.eye(count - 1, count)
    smooth = SMOOTH * scipy.sparse.kron(change.T @ change, scipy.sparse.eye(m))
    nothing = scipy.sparse.csc_matrix((size, size))
    free = scipy.sparse.csc_matrix((counted, counted))
    return scipy.sparse.block_diag(
        [scipy.sparse.eye(size), nothing, smooth, LIGHT * scipy.sparse.eye(count * n), free]
    )


def _wrenches(
    demand: Demand, before: Array, scale: Array
) -> tuple[scipy.sparse.spmatrix, NDArray[np.float64]]:
    """Return rows and right side of: tensions give what the deviation's acceleration requires."""
    size = before.size
    right = demand.wrench - np.einsum("kij,kj->ki", demand.mass, before)
    rows = scipy.sparse.hstack(
        [
            scipy.sparse.csc_matrix((size, 2 * size)),
            -scipy.sparse.block_diag(list(demand.mass * scale)),
            scipy.sparse.block_diag(list(demand.structure)),
        ]
    )
    return rows, right.ravel()


def _bounds(
    limits: Array, count: int, m: int, counted: NDArray[np.int64]
) -> tuple[scipy.sparse.spmatrix, Array]:
    """Return rows and what they may be at most: tensions, and deviations less their excess."""
    size, bounded = count * m, count * len(limits)
    width = 3 * size + bounded + len(counted)
    tensions = scipy.sparse.eye(bounded, width, k=3 * size)
    picked = (counted[:, None] * m + np.arange(m)).ravel()
    deviations = scipy.sparse.eye(size, width).tocsr()[picked]
    own = scipy.sparse.eye(len(counted), width, k=3 * size + bounded)
    shared = scipy.sparse.kron(own, np.ones((m, 1)))
    rows = scipy.sparse.vstack(
        [tensions, -tensions, deviations - shared, -deviations - shared, -own]
    )
    low, high = np.tile(limits[:, 0], count), np.tile(limits[:, 1], count)
    room = np.full(2 * len(picked), ROOM)
    return rows, np.concatenate([high, -low, room, np.zeros(len(counted))])


def _integration(count: int, m: int, n: int) -> scipy.sparse.csc_matrix:
    """Return rows that say: between knots the acceleration is linear in time."""
    here, there = scipy.sparse.eye(count - 1, count), scipy.sparse.eye(count - 1, count, k=1)
    empty = scipy.sparse.csc_matrix((count - 1, count))
    blocks = [
        [there - here, -here, -here / 3.0 - there / 6.0],
        [empty, there - here, -0.5 * (here + there)],
    ]
    states = scipy.sparse.kron(scipy.sparse.bmat(blocks), scipy.sparse.eye(m))
    return scipy.sparse.hstack([states, scipy.sparse.csc_matrix((states.shape[0], count * n))])


def _at_ends(count: int, m: int, n: int, ends: tuple[bool, bool]) -> scipy.sparse.csc_matrix:
    """Return rows that pick place, rate and acceleration at both ends, where they are to be zero.

    A run begins on its reference, whatever comes; it may end elsewhere.
    """
    orders = (0, 1) if ends[0] else (0, 1, 2)
    picked = [order * count * m + np.arange(m) for order in orders]
    if not ends[1]:
        picked += [order * count * m + (count - 1) * m + np.arange(m) for order in range(3)]
    columns = np.concatenate(picked)
    width = count * (3 * m + n)
    rows = np.arange(len(columns))
    return scipy.sparse.csc_matrix((np.ones(len(columns)), (rows, columns)), (len(columns), width))


def _solve(
    cost: scipy.sparse.spmatrix,
    linear: Array,
    equal: tuple[scipy.sparse.spmatrix, Array],
    unequal: tuple[scipy.sparse.spmatrix, Array],
) -> Array:
    """Return the x with least ½xᵀ·cost·x + linearᵀ·x, `equal` and not above `unequal`."""
    cones = [clarabel.ZeroConeT(len(equal[1])), clarabel.NonnegativeConeT(len(unequal[1]))]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    solver = clarabel.DefaultSolver(
        scipy.sparse.triu(cost).tocsc(),
        linear,
        scipy.sparse.vstack([equal[0], unequal[0]]).tocsc(),
        np.concatenate([equal[1], unequal[1]]),
        cones,
        settings,
    )
    found = solver.solve()
    if found.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        raise ConvergenceError(f"governor: no plan found ({found.status}), allowed: a solution")
    return np.array(found.x)
