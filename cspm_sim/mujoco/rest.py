"""Where the machine hangs at rest, found from MuJoCo's kinematics."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_msgs_py.errors import ConvergenceError
from cspm_msgs_py.testbed import Bar
from cspm_sim.mujoco.cable_law import elongation_at
from cspm_sim.mujoco.exertion import HAS_CABLE, OFFSET

Array = NDArray[np.float64]

BALANCED = 1e-9  # of the weight
HELD = 1e-6
_ITERATIONS = 200


def free_direction(attachments: Array) -> Array | None:
    """Return the bar axis about which cables cannot turn the bar, (3,), if there is one.

    It is the line on which all attachments (n, 3) lie; attachments in one point leave more than
    one axis free, and then none is returned.
    """
    spread = attachments - attachments.mean(axis=0)
    _, values, axes = np.linalg.svd(np.vstack([spread, np.zeros((3, 3))]))
    size = np.abs(attachments).max()
    on_a_line = values[0] > BALANCED * size and values[1] <= BALANCED * size
    return np.asarray(axes[0]) if on_a_line else None


def hanging_roll(bar: Bar, attachments: Array, angles: Array) -> float:
    """Return the roll [rad] nearest φ of `angles` at which gravity does not turn the bar.

    It matters where all attachments lie on a line: then gravity may have no moment about it.
    """
    axis = free_direction(attachments)
    start = float(angles[0])
    if axis is None:
        return start
    arm = np.array(bar.com) - attachments[0]

    def moment(roll: float) -> float:
        R_world_bar = _rotation(roll, angles[1], angles[2])
        return float(R_world_bar @ axis @ np.cross(R_world_bar @ arm, [0.0, 0.0, 1.0]))

    if abs(moment(start)) <= BALANCED * max(1.0, float(np.linalg.norm(arm))):
        return start
    try:
        return float(scipy.optimize.newton(moment, start, tol=1e-14, maxiter=100))
    except RuntimeError:
        return start


def _rotation(roll: float, pitch: float, yaw: float) -> Array:
    turns = []
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turn, (j, k) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
        turn[j, j] = turn[k, k] = np.cos(angle)
        turn[k, j] = np.sin(angle)
        turn[j, k] = -turn[k, j]
        turns.append(turn)
    return np.asarray(turns[0] @ turns[1] @ turns[2])


def pulls(ends: Array, centre: Array) -> Array:
    """Return the wrench about the centre of mass per newton in each cable, (6, n)."""
    exits, attachments = np.split(ends, 2)
    directions = exits - attachments
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return np.asarray(np.hstack([directions, np.cross(attachments - centre, directions)]).T)


def holding_tensions(pulls: Array, weight: float, limits: Array) -> Array:
    """Return the tensions (n,) [N], least in norm within `limits` (n, 2), that carry the weight.

    The least tensions are t = clip(Aᵀλ, limits) with A·t = w: the conditions of optimality, six
    equations for λ, solved by Newton's method on their straight pieces.

    Args:
        pulls: A, shape (6, n).
        weight: of the bar, downwards [N].
        limits: lowest and highest tension of each cable [N].

    Raises:
        ConvergenceError: none within the limits do.
    """
    wanted = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])
    size = weight or 1.0
    factors = np.linalg.lstsq(pulls @ pulls.T, wanted, rcond=BALANCED)[0]

    def tensions_at(factors: Array) -> Array:
        return np.asarray(np.clip(pulls.T @ factors, limits[:, 0], limits[:, 1]))

    def missing_at(factors: Array) -> Array:
        return np.asarray(wanted - pulls @ tensions_at(factors))

    missing = missing_at(factors)
    for _ in range(_ITERATIONS):
        error = np.linalg.norm(missing)
        if error <= 1e-13 * size:
            break
        raw = pulls.T @ factors
        free = pulls[:, (raw >= limits[:, 0]) & (raw <= limits[:, 1])]
        step = np.linalg.lstsq(free @ free.T, missing, rcond=BALANCED)[0]
        share = 1.0
        while share > 1e-6 and np.linalg.norm(missing_at(factors + share * step)) >= error:
            share *= 0.5
        if share <= 1e-6:
            break
        factors = factors + share * step
        missing = missing_at(factors)
    left = float(np.linalg.norm(missing)) / size
    if left > HELD:
        raise ConvergenceError(
            "no tensions within the limits hold the bar at rest where it is to start: wrench"
            f" residual {left:.2g} of the weight"
        )
    return tensions_at(factors)


def resting_lengths(lengths: Array, tensions: Array, rows: Array) -> Array:
    """Return l0 (n,) [m] of cables stretched to `lengths` (n,) [m] that carry `tensions` [N]."""
    out = np.zeros(len(lengths))
    for i, (length, tension, row) in enumerate(zip(lengths, tensions, rows, strict=True)):
        if row[HAS_CABLE] and tension > 0.0:
            out[i] = scipy.optimize.brentq(
                _gap, 0.5 * length, length, (length, tension, row), xtol=1e-15
            )
        elif row[HAS_CABLE]:
            out[i] = length
    return out


def _gap(unstretched: float, length: float, tension: float, row: Array) -> float:
    return float(unstretched + elongation_at(tension, unstretched + row[OFFSET], row) - length)
