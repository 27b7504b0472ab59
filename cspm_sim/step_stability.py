"""How many steps a plant takes in a period, for the axial modes of its cables.

About a state the elongations e of the cables obey ë = −W·(K·e + D·ė): W = J·M⁻¹·Jᵀ + diag(w·r²/I)
is what a unit of tension accelerates bar and winches by, w = l0/l since a winch winds stretched
cable (2-18); K and D are tangent stiffness and damping.
The classical Runge-Kutta step of length h keeps a mode λ bounded where |1 + z + z²/2 + z³/6 +
z⁴/24| is at most 1, z = h·λ (Hairer, Wanner, Solving Ordinary Differential Equations II, section
IV.2). Where one step of a plant's period does not, as with steel cables, the plant takes several:
each so short that |z| ≤ 1/2, where a mode is right to z⁵/120, 0.03 %, a step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels.cable import (
    DAMPING_CONSTANT,
    DAMPING_SLOPE,
    FLOOR_TENSION,
    HAS_CABLE,
    INERTIA,
    OFFSET_LENGTH,
    RADIUS,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import geometry
from cspm_model.linearisation import mass_matrix
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Round-off of a mode without damping.
SLACK = 1e-9
# A slack cable counts as just taut: stretched by this share of its length.
LEAST_STRETCH = 1e-12
# How far a step may take a mode that is too fast for one step a period, and how many steps a period
# may have: with more, a run takes longer than most would wait.
LARGEST_REACH, MOST_STEPS = 0.5, 200


def axial_modes(
    parameters: PlantParameters,
    bar_pose: ArrayLike | None,
    frame_pose: ArrayLike,
    lengths: tuple[Array, Array],
    tensions: Array | None,
    *,
    locked: bool,
) -> Complex:
    """Return the eigenvalues [1/s] of the cables' axial modes about a state, (2n,).

    Args:
        parameters: of the machine.
        bar_pose: x y z φ θ ψ; None without a bar, whose cables end at fixed points.
        frame_pose: the winch frame's.
        lengths: unstretched and stretched, each (n,) [m].
        tensions: (n,) [N]; absent: enough for the dampers to act in full.
        locked: whether the winches stand still.
    """
    chosen = np.flatnonzero(parameters.cables[:, HAS_CABLE] > 0.0)
    cables, n = parameters.cables[chosen], len(chosen)
    unstretched, stretched = lengths
    give = np.zeros((n, n))
    if bar_pose is not None:
        jacobian = geometry(parameters.cables, bar_pose, frame_pose).bar[chosen]
        give += jacobian @ np.linalg.solve(mass_matrix(parameters, bar_pose), jacobian.T)
    if not locked:
        give += np.diag(
            cables[:, RADIUS] ** 2 / cables[:, INERTIA] * unstretched[chosen] / stretched[chosen]
        )
    stiffness = np.array(
        [_stiffness(parameters, int(i), unstretched[i], stretched[i]) for i in chosen]
    )
    elastic = unstretched[chosen] + cables[:, OFFSET_LENGTH]
    damping = np.maximum(0.0, cables[:, DAMPING_CONSTANT] - cables[:, DAMPING_SLOPE] * elastic)
    # Below its floor tension the damper of `kernels.cable.cable_tensions` fades.
    if tensions is not None:
        damping *= np.minimum(1.0, tensions[chosen] / cables[:, FLOOR_TENSION])
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-give * stiffness, -give * damping]])
    return np.asarray(np.linalg.eigvals(system), dtype=np.complex128)


def steps_needed(modes: Complex, rate: int) -> int:
    """Return how many steps a plant takes in each period so that its modes are bounded.

    Args:
        modes: eigenvalues (k,) [1/s].
        rate: of the plant [Hz].

    Raises:
        InputError: more than any run would wait for.
    """
    if not len(modes) or is_stable(modes, rate):
        return 1
    fastest = float(np.abs(modes).max())
    steps = int(np.ceil(fastest / (rate * LARGEST_REACH)))
    if steps > MOST_STEPS:
        raise InputError(
            f"rates.plant: {rate} Hz, with cables whose axial mode has {fastest:.4g} rad/s,"
            f" allowed: at most {rate * LARGEST_REACH * MOST_STEPS:.4g} rad/s; a softer cable, a"
            " heavier bar or winch, or a higher rate: `--set rates.plant=…`"
        )
    return steps


def steps_along(
    parameters: PlantParameters,
    poses: tuple[Array, Array],
    lengths: tuple[Array, Array],
    tensions: Array,
    rate: int,
    *,
    locked: bool,
) -> int:
    """Return how many steps a plant with a bar takes in each period along a reference.

    The cables are stretched by the same share of their lengths as where they were looked at.

    Args:
        parameters: of the machine.
        poses: of bar and winch frame, (k, 6) each.
        lengths: unstretched and stretched where they were looked at, each (n,) [m].
        tensions: (n,) [N].
        rate: of the plant [Hz].
        locked: whether the winches stand still.

    Raises:
        InputError: as `steps_needed`.
    """
    share = lengths[0] / lengths[1]
    found = 1
    for bar, frame in zip(*poses, strict=True):
        stretched = geometry(parameters.cables, bar, frame).lengths
        there = (share * stretched, stretched)
        modes = axial_modes(parameters, bar, frame, there, tensions, locked=locked)
        found = max(found, steps_needed(modes, rate))
    return found


def is_stable(modes: Complex, rate: int) -> bool:
    """Return whether the step of a plant's rate [Hz] keeps modes (k,) [1/s] bounded."""
    z = modes / rate
    with np.errstate(over="ignore", invalid="ignore"):
        growth = np.abs(1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6.0 + z / 24.0))))
    return bool((growth <= 1.0 + SLACK).all())


def _stiffness(p: PlantParameters, i: int, unstretched: float, stretched: float) -> float:
    """Return the tangent stiffness of cable i [N/m]; that of its slackest where it is slack."""
    elastic = float(unstretched + p.cables[i, OFFSET_LENGTH])
    elongation = max(stretched - unstretched, LEAST_STRETCH * elastic)
    scale = law_scale(elastic, p.cables, i)
    return float(elastic_tension(elongation, elastic, scale, p.cables, p.tables, i)[1])
