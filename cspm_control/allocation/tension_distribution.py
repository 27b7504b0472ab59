"""From a wanted wrench to cable tensions that judge themselves; the methods stand beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from cspm_control.allocation.analytic_centre import analytic_centre, centre_memory
from cspm_control.allocation.closed_form import (
    closed_form,
    improved_closed_form,
    limit_tensions,
    pseudo_inverse,
    removal,
)
from cspm_control.allocation.null_space import TURNED, TURNED_TEXT, prescribed, prescribed_memory
from cspm_control.allocation.preferred_tension import AT_LIMIT, PreferredTension
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.native import address_of, caller_of
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.kernels.rows import pose_row
from cspm_msgs_py.control_spec.distribution import DistributionMethod
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import SingularityError
from cspm_msgs_py.scenario import DESIGN_POSE

Array = NDArray[np.float64]
Axes = NDArray[np.int64]
# (structure (m, n), wrench (m,), limits (n, 2), weights (m,), memory, tensions out (n,)) → how many
# of these are known to stand at a limit, −1 where no tensions give some wrench.
Method = Callable[[Array, Array, Array, Array, Array, Array], int]
METHOD = types.int64(
    types.float64[:, ::1],
    types.float64[::1],
    types.float64[:, ::1],
    types.float64[::1],
    types.float64[::1],
    types.float64[::1],
)
call_method = caller_of(METHOD)
_VECTOR, _MATRIX = types.float64[::1], types.float64[:, ::1]
# Of `distribute`.
DISTRIBUTE = types.int64(
    *(types.int64, _VECTOR, _VECTOR, _VECTOR, types.float64[::1, :], types.int64[::1]),
    *(_MATRIX, _VECTOR, _MATRIX, _VECTOR, _VECTOR, _MATRIX, _VECTOR),
)

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
        unlimited: the tensions before each was limited to its range, shape (n,) [N].
    """

    tensions: Array
    residual: float
    saturated: int
    feasible: bool
    unlimited: Array

    def active_limits(self, limits: Array) -> Array:
        """Return −1 at the lower limit, 1 at the upper one and 0 between, shape (n,).

        Args:
            limits: tension limits (n, 2) [N].
        """
        low, high = limits[:, 0] + AT_LIMIT, limits[:, 1] - AT_LIMIT
        return np.subtract(self.tensions >= high, self.tensions <= low, dtype=np.float64)


class TensionDistribution:
    """t with −Jᵀt = w in the controlled axes and every tension within its limits, if there is one.

    Where there is none, `analytic_centre` and `qp` give the nearest wrench by weights; the others
    limit each tension by itself.

    Attributes:
        cables: the plant's cable rows.
        limits: tension limits (n, 2) [N].
        axes: world axes in which the wrench is to be met, (m,).
        structure: A at the last poses, (m, n).
        wanted: the last wrench in these axes, (m,) [N, N·m].
        weights: of what is missing of it, (m,).
        memory: what a method keeps from step to step.
        tensions: the last ones before and after each was limited to its range, (2, n) [N].
        residual: what these miss of the wrench, as a share of its norm, (1,).
    """

    def __init__(
        self,
        cables: Array,
        limits: Array,
        how: HowDistributed | None = None,
        axes: Sequence[int] = CONTROLLED_AXES,
        design_pose: Sequence[float] = DESIGN_POSE,
    ) -> None:
        """Choose machine and method.

        Args:
            cables: the plant's cable rows.
            limits: tension limits (n, 2) [N].
            how: method and its settings; absent: those of a scenario that names none.
            axes: world axes (0 to 5) in which the wrench is to be met.
            design_pose: of the bar, x y z φ θ ψ with the winch frame at the origin, where the
                method `prescribed` chooses its basis of the null space.

        Raises:
            InputError: what the method prescribes does not fit the machine.
        """
        how = how or HowDistributed()
        self.cables, self._how = cables, how
        self.limits = np.ascontiguousarray(limits, dtype=np.float64)
        self.axes: Axes = np.array(axes, dtype=np.int64)
        self.weights = np.array(how.wrench_weights)[self.axes] ** 2
        self.structure = np.zeros((len(self.axes), len(cables)))
        self.wanted = np.zeros(len(self.axes))
        self.tensions, self.residual = np.zeros((2, len(cables))), np.zeros(1)
        self.memory = centre_memory(*self.structure.shape)
        self._address: int | None = None
        self._method = self._method_of(how, np.array(design_pose, dtype=float))

    def _method_of(self, how: HowDistributed, design_pose: Array) -> Method:
        if how.method == "qp":
            return PreferredTension(how.preferred_tension)
        if how.null_space is None:
            self._address = address_of(KERNELS[how.method], METHOD)
            return KERNELS[how.method]
        bar, frame = np.empty(7), np.empty(7)
        pose_row(design_pose, bar)
        pose_row(np.zeros(6), frame)
        fill_structure(bar, frame, self.cables, self.axes, self.structure)
        self.memory = prescribed_memory(how.null_space, self.structure)
        self._address = address_of(prescribed, METHOD)
        return prescribed

    def without(self, lost: NDArray[np.bool_]) -> TensionDistribution:
        """Return the same of a machine without the cables where `lost` (n,) is true."""
        kept = ~lost
        cables = np.asfortranarray(self.cables[kept])
        return TensionDistribution(cables, self.limits[kept], self._how, self.axes.tolist())

    def step(self, wrench: Array, bar_pose: Array, frame_pose: Array) -> Distribution:
        """Return tensions for a wrench row (6,) at measured pose rows (7,) of bar and frame.

        Raises:
            SingularityError: at these poses no tensions give some wrench.
        """
        saturated = self._distribute(wrench, bar_pose, frame_pose)
        if saturated == TURNED:
            raise SingularityError(TURNED_TEXT)
        if saturated < 0:
            place = ", ".join(f"{value:.4g}" for value in bar_pose)
            raise SingularityError(
                f"tension distribution: with the bar measured at [{place}] (m, quaternion) the"
                " cables cannot give every force and moment along"
                f" {', '.join(DOFS[axis] for axis in self.axes)}"
            )
        unlimited, tensions = self.tensions.copy()
        residual = float(self.residual[0])
        feasible = residual <= RESIDUAL_TOLERANCE
        return Distribution(tensions, residual, saturated, feasible, unlimited)

    @property
    def address(self) -> int | None:
        """The address of the method's kernel, None where Python computes."""
        return self._address

    def _distribute(self, wrench: Array, bar_pose: Array, frame_pose: Array) -> int:
        bar, frame, own = bar_pose, frame_pose, (self.cables, self.axes, self.structure)
        if self._address is not None:
            return distribute(
                self._address,
                *(np.ascontiguousarray(wrench), bar, frame, *own),
                *(
                    self.wanted,
                    self.limits,
                    self.weights,
                    self.memory,
                    self.tensions,
                    self.residual,
                ),
            )
        fill_structure(bar, frame, *own)
        self.wanted[:] = wrench[self.axes]
        unlimited = self.tensions[0]
        given = self.structure, self.wanted, self.limits, self.weights, self.memory
        saturated = self._method(*given, unlimited)
        if saturated < 0:
            return saturated
        return saturated + judge(
            self.structure, self.wanted, self.limits, self.tensions, self.residual
        )


@njit(cache=True, error_model="numpy")
def distribute(
    method: int,
    wrench: Array,
    bar_pose: Array,
    frame_pose: Array,
    cables: Array,
    axes: Axes,
    structure: Array,
    wanted: Array,
    limits: Array,
    weights: Array,
    memory: Array,
    tensions: Array,
    residual: Array,
) -> int:
    """Write tensions, before and after each is limited, (2, n), by the method at an address.

    Arrays as those of `TensionDistribution`. Returns how many stand at a limit, −1 where at these
    poses no tensions give some wrench.
    """
    fill_structure(bar_pose, frame_pose, cables, axes, structure)
    for row in range(axes.shape[0]):
        wanted[row] = wrench[axes[row]]
    saturated = call_method(method, structure, wanted, limits, weights, memory, tensions[0])
    if saturated < 0:
        return saturated
    return saturated + judge(structure, wanted, limits, tensions, residual)


@njit(cache=True, error_model="numpy")
def judge(structure: Array, wanted: Array, limits: Array, tensions: Array, residual: Array) -> int:
    """Write limited tensions, row 1, and what they miss; return how many were beyond a limit."""
    for i in range(tensions.shape[1]):
        tensions[1, i] = tensions[0, i]
    limited = limit_tensions(limits, tensions[1])
    residual[0] = _residual(structure, wanted, tensions[1])
    return limited


@njit(cache=True, error_model="numpy")
def fill_structure(
    bar_pose: Array, frame_pose: Array, cables: Array, axes: Axes, out: Array
) -> None:
    """Write the rows of −Jᵀ in some world axes, shape (m, n), at pose rows (7,)."""
    n = cables.shape[0]
    bar, frame = np.empty(6), np.empty(6)
    for d in range(3):
        bar[d], frame[d] = bar_pose[d], frame_pose[d]
    bar[3], bar[4], bar[5] = euler_from_quaternion(bar_pose[3:7])
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
        found = 0.0
        for i in range(tensions.shape[0]):
            found += structure[row, i] * tensions[i]
        missing += (found - wanted[row]) ** 2
        total += wanted[row] ** 2
    return np.sqrt(missing / max(total, 1e-24))
