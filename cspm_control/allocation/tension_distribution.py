"""From a wanted wrench to cable tensions that judge themselves; the methods stand beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.analytic_centre import analytic_centre
from cspm_control.allocation.closed_form import (
    closed_form,
    improved_closed_form,
    pseudo_inverse,
    removal,
)
from cspm_control.allocation.preferred_tension import PreferredTension
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import SingularityError
from cspm_msgs_py.scenario import DistributionMethod
from cspm_msgs_py.scenario import TensionDistribution as HowDistributed

Array = NDArray[np.float64]
# (structure (m, n), wrench (m,), limits (n, 2), weights (m,), tensions out (n,)) → how many
# tensions stand at a limit, −1 where no tensions give some wrench.
Method = Callable[[Array, Array, Array, Array, Array], int]

# A wrench counts as met when what is missing is below this share of it.
RESIDUAL_TOLERANCE = 1e-6
KERNELS: dict[DistributionMethod, Method] = {
    "pseudo_inverse": pseudo_inverse,
    "removal": removal,
    "closed_form": closed_form,
    "improved_closed_form": improved_closed_form,
    "analytic_centre": analytic_centre,
}


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


class TensionDistribution:
    """t with −Jᵀt = w in the controlled axes and every tension within its limits, if there is one.

    Where there is none, `analytic_centre` and `qp` give the nearest wrench by weights; the others
    limit each tension by itself.
    """

    def __init__(
        self,
        cables: Array,
        limits: Array,
        how: HowDistributed | None = None,
        axes: Sequence[int] = CONTROLLED_AXES,
    ) -> None:
        """Choose machine and method.

        Args:
            cables: the plant's cable rows.
            limits: tension limits (n, 2) [N].
            how: method and its settings; absent: those of a scenario that names none.
            axes: world axes (0 to 5) in which the wrench is to be met.
        """
        how = how or HowDistributed()
        self.cables = cables
        self._limits = limits
        self._axes = np.array(axes)
        self._weights = np.array(how.wrench_weights)[self._axes] ** 2
        self._method: Method = (
            PreferredTension(how.preferred_tension) if how.method == "qp" else KERNELS[how.method]
        )
        self._structure = np.zeros((len(self._axes), len(cables)))
        self._wanted = np.zeros(len(self._axes))

    def step(self, wrench: Array, bar_pose: Array, frame_pose: Array) -> Distribution:
        """Return tensions for a wrench row (6,) at measured pose rows (7,) of bar and frame.

        Raises:
            SingularityError: at these poses no tensions give some wrench.
        """
        fill_structure(bar_pose, frame_pose, self.cables, self._axes, self._structure)
        self._wanted[:] = wrench[self._axes]
        tensions = np.empty(len(self.cables))
        saturated = self._method(
            self._structure, self._wanted, self._limits, self._weights, tensions
        )
        if saturated < 0:
            place = ", ".join(f"{value:.4g}" for value in bar_pose)
            raise SingularityError(
                f"tension distribution: with the bar measured at [{place}] (m, quaternion) the"
                " cables cannot give every force and every moment"
                + ("" if 3 in self._axes else " but roll")
            )
        residual = _residual(self._structure, self._wanted, tensions)
        return Distribution(tensions, residual, saturated, residual <= RESIDUAL_TOLERANCE)


@njit(cache=True, error_model="numpy")
def fill_structure(
    bar_pose: Array, frame_pose: Array, cables: Array, axes: NDArray[np.int64], out: Array
) -> None:
    """Write the rows of −Jᵀ in some world axes, shape (m, n), at pose rows (7,)."""
    n = cables.shape[0]
    bar, frame = np.empty(6), np.empty(6)
    bar[:3] = bar_pose[:3]
    bar[3], bar[4], bar[5] = euler_from_quaternion(bar_pose[3:7])
    frame[:3] = frame_pose[:3]
    frame[3], frame[4], frame[5] = euler_from_quaternion(frame_pose[3:7])
    lengths, jacobians = np.empty(n), np.empty((2, n, 6))
    cable_geometry(cables, bar, frame, lengths, jacobians[0], jacobians[1])
    for row in range(axes.shape[0]):
        for i in range(n):
            out[row, i] = -jacobians[0, i, axes[row]]


@njit(cache=True, error_model="numpy")
def _residual(structure: Array, wanted: Array, tensions: Array) -> float:
    """Return |A·t − w| as a share of |w|."""
    missing = total = 0.0
    for row in range(wanted.shape[0]):
        missing += ((structure[row] * tensions).sum() - wanted[row]) ** 2
        total += wanted[row] ** 2
    return np.sqrt(missing / max(total, 1e-24))
