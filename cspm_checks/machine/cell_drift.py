"""Which load cell drifts against the others, by the balance of forces on the bar.

The cables' tensions hold the bar: Σ uᵢ·tᵢ + weight = mass times acceleration, and likewise about
its centre. A cell that drifts leaves a wrench along its own cable that grows with time; biases of
all cells and a constant wrench are left free.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.machine.poses import Poses
from cspm_checks.motion import smoothed
from cspm_checks.series import SensorSeries
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Bar, Testbed

Array = NDArray[np.float64]
BLOCK_S = 0.25
"""Over which a wrench is averaged, so that accelerations lose their noise."""
SIGMAS = 6.0
MATERIAL = 0.01
"""Of the mean tension, over the recording: bridges and amplifiers warm up by less."""
APART = 1.5
"""Times what the next cell explains."""
_FEWEST_BLOCKS = 20
_LONGEST = 2_000_000


class Drift(NamedTuple):
    """A load cell that drifts.

    Attributes:
        cell: its place among those that were judged.
        rate: [N/s].
        error: half the interval of 95 % [N/s].
        change: over the recording [N].
    """

    cell: int
    rate: float
    error: float
    change: float


def cell_drift(
    testbed: Testbed, bar: Poses, frame: Poses | None, tensions: list[SensorSeries]
) -> Drift | None:
    """Return which load cell drifts against the others; None where none is sure.

    Args:
        testbed: the machine, all of whose cables have a load cell.
        bar: the bar's poses, at equal steps.
        frame: the winch frame's; None where it stands still.
        tensions: of all cables [N].
    """
    step = float(np.median(np.diff(bar.time))) if len(bar.time) > 2 else 0.0
    length = round(BLOCK_S / step) if step > 0.0 else 0
    blocks = min(len(bar.time), _LONGEST) // max(length, 1)
    if testbed.bar is None or length < 3 or blocks < _FEWEST_BLOCKS:
        return None
    count = blocks * length
    arms, wrenches, time = _wrenches(testbed, testbed.bar, bar, frame, tensions, (count, length))
    seconds = time - time.mean()
    free = [-arms[:, j].ravel() for j in range(arms.shape[1])]
    free += [np.tile(unit, len(seconds)) for unit in np.eye(wrenches.shape[1])]
    table, goal = np.stack(free, axis=1), wrenches.ravel()
    found = [
        _fit(table, -(arms[:, j] * seconds[:, None]).ravel(), goal) for j in range(arms.shape[1])
    ]
    return _chosen(found, np.array([one.values.mean() for one in tensions]), float(np.ptp(time)))


def _chosen(found: list[tuple[float, float, float]], tensions: Array, span: float) -> Drift | None:
    order = sorted(range(len(found)), key=lambda j: -found[j][2])
    best, others = order[0], order[1:]
    rate, sigma, share = found[best]
    sure = abs(rate) > SIGMAS * sigma and abs(rate) * span > MATERIAL * abs(tensions[best])
    if not sure or (others and share < APART * found[others[0]][2]):
        return None
    return Drift(best, rate, 2.0 * sigma, rate * span)


def _wrenches(
    testbed: Testbed,
    body: Bar,
    bar: Poses,
    frame: Poses | None,
    tensions: list[SensorSeries],
    blocks: tuple[int, int],
) -> tuple[Array, Array, Array]:
    """Return the cables' wrenches per tension (k, n, 6), what is left (k, 6) [N], and instants.

    All are of the means over blocks, of which `blocks` has all samples and those of one.
    """
    count, length = blocks
    cables, instants = nominal_parameters(testbed).cables, bar.time[:count]
    step = float(np.median(np.diff(instants)))
    whole = bar.with_angles()[:count]
    acceleration = _means(np.stack([smoothed(each, 2, step) for each in whole.T], axis=1), length)
    series = [np.interp(instants, one.time, one.values) for one in tensions]
    pulls, poses = _means(np.stack(series, axis=1), length), _means(whole, length)
    time = _means(instants, length)
    bases = np.zeros_like(poses) if frame is None else frame.at(time).with_angles()
    arms = np.empty((len(poses), len(cables), 6))
    lengths, of_frame = np.empty(len(cables)), np.empty((len(cables), 6))
    for k in range(len(poses)):
        cable_geometry(cables, poses[k], bases[k], lengths, arms[k], of_frame)
    left = -np.einsum("kni,kn->ki", arms, pulls)
    left[:, 2] += body.mass * testbed.gravity
    left[:, :3] -= body.mass * acceleration[:, :3]
    left[:, 3:] -= acceleration[:, 3:] @ np.asarray(body.inertia.matrix)
    # A moment counts as the force at the radius of gyration that makes it.
    gyration = np.sqrt(np.trace(np.asarray(body.inertia.matrix)) / 3.0 / body.mass)
    scale = np.array([1.0, 1.0, 1.0, *(1.0 / gyration,) * 3])
    moving = np.abs(arms * scale).max(axis=(0, 1)) > 1e-6
    return (arms * scale)[:, :, moving], (left * scale)[:, moving], time


def _means(table: Array, length: int) -> Array:
    return np.asarray(table.reshape(-1, length, *table.shape[1:]).mean(axis=1))


def _fit(free: Array, column: Array, goal: Array) -> tuple[float, float, float]:
    """Return a column's coefficient, its standard error, and the share that it explains."""
    basis = np.linalg.svd(free, full_matrices=False)
    kept = basis[0][:, basis[1] > 1e-9 * basis[1][0]]
    column, goal = (each - kept @ (kept.T @ each) for each in (column, goal))
    power = float(column @ column)
    if not power > 0.0:
        return 0.0, np.inf, 0.0
    rate = float(column @ goal) / power
    rest = goal - rate * column
    sigma = np.sqrt(float(rest @ rest) / max(len(goal) - kept.shape[1] - 1, 1) / power)
    return rate, float(sigma), 1.0 - float(rest @ rest) / max(float(goal @ goal), 1e-300)
