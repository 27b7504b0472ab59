"""From a wanted wrench to cable tensions: pseudo-inverse with saturation, thesis (5-1) and 7."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.errors import SingularityError
from cspm_sim.kernels.kinematics import cable_geometry
from cspm_sim.kernels.rotation import euler_from_quaternion

Array = NDArray[np.float64]

# The world axes in which the wrench is met: all but the roll moment.
CONTROLLED_AXES = (0, 1, 2, 4, 5)
# A wrench counts as met when what is missing is below this share of it.
RESIDUAL_TOLERANCE = 1e-6
# A pivot below this share of its diagonal is round-off: the rows do not have full rank.
SMALLEST_PIVOT = 1e-12


class Distribution(NamedTuple):
    """A tension set that judges itself.

    Attributes:
        tensions: shape (n,) [N], within the limits.
        residual: what the tensions miss of the wrench, as a share of its norm.
        saturated: how many tensions stand at a limit.
        feasible: whether the wrench is met.
    """

    tensions: Array
    residual: float
    saturated: int
    feasible: bool


class PseudoInverse:
    """t = −(Jᵀ)†w with the roll row dropped, each tension then limited to its range."""

    def __init__(self, cables: Array, limits: Array) -> None:
        """Take the plant's cable rows and the tension limits (n, 2) [N]."""
        n = len(cables)
        self._cables = cables
        self._limits = limits
        self._jacobians = np.zeros((2, n, 6))
        self._lengths = np.zeros(n)

    def step(self, wrench: Array, bar_pose: Array, frame_pose: Array) -> Distribution:
        """Return tensions for a wrench row (6,) at measured pose rows (7,) of bar and frame.

        Raises:
            SingularityError: at these poses no tensions give some wrench.
        """
        tensions = np.empty(len(self._cables))
        residual, saturated = _pseudo_inverse(
            wrench,
            bar_pose,
            frame_pose,
            self._cables,
            self._limits,
            self._lengths,
            self._jacobians,
            tensions,
        )
        if saturated < 0:
            place = ", ".join(f"{value:.4g}" for value in bar_pose)
            raise SingularityError(
                f"tension distribution: with the bar measured at [{place}] (m, quaternion) the"
                " cables cannot give every force and every moment but roll"
            )
        return Distribution(tensions, residual, saturated, residual <= RESIDUAL_TOLERANCE)


@njit(cache=True, error_model="numpy")
def _solve_gram(rows: Array, wanted: Array) -> bool:
    """Solve (A·Aᵀ)·y = w by Cholesky's method for A = `rows` (m, n), y left in `wanted`.

    Returns False, with nothing solved, where A has no full row rank. A library's solver would do
    the same; compiling the call to it takes seconds of every first run.
    """
    m = rows.shape[0]
    factor = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            diagonal = (rows[i] * rows[j]).sum()
            rest = diagonal - (factor[i, :j] * factor[j, :j]).sum()
            if i == j:
                if not rest > SMALLEST_PIVOT * diagonal:
                    return False
                factor[i, i] = np.sqrt(rest)
            else:
                factor[i, j] = rest / factor[j, j]
    for i in range(m):
        wanted[i] = (wanted[i] - (factor[i, :i] * wanted[:i]).sum()) / factor[i, i]
    for i in range(m - 1, -1, -1):
        wanted[i] = (wanted[i] - (factor[i + 1 :, i] * wanted[i + 1 :]).sum()) / factor[i, i]
    return True


@njit(cache=True, error_model="numpy")
def _pseudo_inverse(
    wrench: Array,
    bar_pose: Array,
    frame_pose: Array,
    cables: Array,
    limits: Array,
    lengths: Array,
    jacobians: Array,
    out: Array,
) -> tuple[float, int]:
    """Write limited tensions to `out`; return relative residual and how many are limited.

    How many is −1, and nothing is written, where no tensions give some wrench.
    """
    n, m = cables.shape[0], len(CONTROLLED_AXES)
    bar, frame = np.empty(6), np.empty(6)
    bar[:3] = bar_pose[:3]
    bar[3], bar[4], bar[5] = euler_from_quaternion(bar_pose[3:7])
    frame[:3] = frame_pose[:3]
    frame[3], frame[4], frame[5] = euler_from_quaternion(frame_pose[3:7])
    cable_geometry(cables, bar, frame, lengths, jacobians[0], jacobians[1])
    structure, wanted = np.empty((m, n)), np.empty(m)
    for row in range(m):
        axis = CONTROLLED_AXES[row]
        wanted[row] = wrench[axis]
        for i in range(n):
            structure[row, i] = -jacobians[0, i, axis]
    multipliers = wanted.copy()
    if not _solve_gram(structure, multipliers):
        return 0.0, -1
    saturated = 0
    for i in range(n):
        tension = (structure[:, i] * multipliers).sum()
        out[i] = min(limits[i, 1], max(limits[i, 0], tension))
        saturated += out[i] != tension
    missing = asked = 0.0
    for row in range(m):
        missing += ((structure[row] * out).sum() - wanted[row]) ** 2
        asked += wanted[row] ** 2
    return np.sqrt(missing / max(asked, 1e-24)), saturated
