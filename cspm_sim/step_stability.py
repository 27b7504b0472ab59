"""Whether a plant's step is short enough for the axial modes of its cables.

About a state the elongations e of the cables obey ë = −W·(K·e + D·ė): W = J·M⁻¹·Jᵀ + diag(w·r²/I)
is what a unit of tension accelerates bar and winches by, w = l0/l since a winch winds stretched
cable (2-18); K and D are tangent stiffness and damping.
The classical Runge-Kutta step of length h keeps a mode λ bounded where |1 + z + z²/2 + z³/6 +
z⁴/24| is at most 1, z = h·λ (Hairer, Wanner, Solving Ordinary Differential Equations II, section
IV.2).
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
# Rates that are proposed [Hz]; each has a period of a whole number of ns.
RATES = (1000, 2000, 4000, 5000, 8000, 10_000, 20_000, 40_000, 50_000, 100_000, 200_000, 1_000_000)


def axial_modes(
    parameters: PlantParameters,
    bar_pose: ArrayLike | None,
    frame_pose: ArrayLike,
    lengths: tuple[Array, Array],
    tensions: Array,
    *,
    locked: bool,
) -> Complex:
    """Return the eigenvalues [1/s] of the cables' axial modes about a state, (2n,).

    Args:
        parameters: of the machine.
        bar_pose: x y z φ θ ψ; None without a bar, whose cables end at fixed points.
        frame_pose: the winch frame's.
        lengths: unstretched and stretched, each (n,) [m].
        tensions: (n,) [N].
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
    damping *= np.minimum(1.0, tensions[chosen] / cables[:, FLOOR_TENSION])
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-give * stiffness, -give * damping]])
    return np.asarray(np.linalg.eigvals(system), dtype=np.complex128)


def check_step(modes: Complex, rate: int) -> None:
    """Check that a plant's step keeps its modes bounded.

    Args:
        modes: eigenvalues (k,) [1/s].
        rate: of the plant [Hz].

    Raises:
        InputError: it does not; the line names the rate that does.
    """
    if not len(modes) or is_stable(modes, rate):
        return
    enough = [each for each in RATES if each > rate and is_stable(modes, each)]
    fastest = modes[np.argmax(np.abs(modes))]
    allowed = f"{enough[0]} Hz or more" if enough else "a softer or more lightly damped cable"
    raise InputError(
        f"rates.plant: {rate} Hz, a step of {1e3 / rate:g} ms, with cables whose axial mode has"
        f" {abs(fastest):.4g} rad/s, allowed: {allowed}; `--set rates.plant=…`"
    )


def is_stable(modes: Complex, rate: int) -> bool:
    """Return whether the step of a plant's rate [Hz] keeps modes (k,) [1/s] bounded."""
    z = modes / rate
    growth = np.abs(1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6.0 + z / 24.0))))
    return bool((growth <= 1.0 + SLACK).all())


def _stiffness(p: PlantParameters, i: int, unstretched: float, stretched: float) -> float:
    """Return the tangent stiffness of cable i [N/m]; that of its slackest where it is slack."""
    elastic = float(unstretched + p.cables[i, OFFSET_LENGTH])
    elongation = max(stretched - unstretched, LEAST_STRETCH * elastic)
    scale = law_scale(elastic, p.cables, i)
    return float(elastic_tension(elongation, elastic, scale, p.cables, p.tables, i)[1])
