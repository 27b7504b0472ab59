"""The linear model of a machine with all that chapter 6 of the thesis reads out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.analysis.gain import Directions, directions, relative_gains, singular_values
from cspm_control.analysis.mode import Mode, drifting_poles, modes
from cspm_model.kinematics import RANK_TOLERANCE
from cspm_model.linearisation import (
    OperatingPoint,
    StateSpace,
    linear_model,
    motion_subsystem,
    operating_point,
    tension_subsystem,
)
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Where the thesis takes singular values and relative gains [rad/s].
LOW = 0.1
FREQUENCIES: Array = np.geomspace(LOW, 1e4, 301)


@dataclass(frozen=True, eq=False)
class SubsystemAnalysis:
    """A sub-system's gains over `FREQUENCIES`.

    Attributes:
        system: the sub-system.
        gains: singular values (m, k).
        relative: relative gain arrays (m, outputs, inputs).
        low: directions at `LOW`.
    """

    system: StateSpace
    gains: Array
    relative: ComplexArray
    low: Directions


@dataclass(frozen=True, eq=False)
class LinearAnalysis:
    """One linear model: all of it, its modes, its two sub-systems.

    Attributes:
        model: motor torques to pose, pose rate and tensions.
        modes: slowest first, without drifting ones.
        drifting: how many poles are at zero.
        motion: wanted wrench to pose (6-2).
        tension: motor torques to tensions (6-6).
    """

    model: StateSpace
    modes: list[Mode]
    drifting: int
    motion: SubsystemAnalysis
    tension: SubsystemAnalysis


@dataclass(frozen=True, eq=False)
class LinearAnalyses:
    """Both linear models of a machine about one state of rest.

    Attributes:
        point: the state of rest.
        rank: of Jᵀ: how many directions of a wrench the cables span.
        frozen: cable directions and stiffness held, as in the thesis.
        exact: the derivative of the plant.
    """

    point: OperatingPoint
    rank: int
    frozen: LinearAnalysis
    exact: LinearAnalysis


def analyse_linear(testbed: Testbed, pose: ArrayLike) -> LinearAnalyses:
    """Return the analysis of a machine's linear models at the state of rest at or near `pose`.

    Its effects are left out.

    Args:
        testbed: the machine.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; the winch frame is at the origin.

    Raises:
        InputError: the test-bed has no bar.
        ConvergenceError: no tensions within the cables' limits hold the bar there.
    """
    parameters = nominal_parameters(testbed)
    point = operating_point(testbed, parameters, pose)

    def analysis(*, exact: bool) -> LinearAnalysis:
        model = linear_model(testbed, parameters, point, exact=exact)
        return LinearAnalysis(
            model=model,
            modes=modes(model, parameters, point, testbed.cable_names),
            drifting=drifting_poles(model),
            motion=_subsystem(motion_subsystem(model, parameters, point)),
            tension=_subsystem(tension_subsystem(model)),
        )

    rank = int(np.linalg.matrix_rank(point.jacobian, rtol=RANK_TOLERANCE))
    return LinearAnalyses(point, rank, analysis(exact=False), analysis(exact=True))


def _subsystem(system: StateSpace) -> SubsystemAnalysis:
    response = system.response(FREQUENCIES)
    return SubsystemAnalysis(
        system, singular_values(response), relative_gains(response), directions(response[0])
    )
