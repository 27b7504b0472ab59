"""Modes of the linear model: frequency, damping, and what moves, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.cable_groups import cable_groups
from cspm_model.kernels import cable as cable_kernel
from cspm_model.kernels.machine import BAR_STATES, PlantParameters
from cspm_model.linearisation import OperatingPoint, StateSpace, mass_matrix
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# A pole closer to zero than this is one of drifting; round-off spreads several of them, the model's
# entries of up to 1e5 with it [rad/s].
SLOWEST = 1e-3
# A coordinate with less than this share of a mode's kinetic energy is not named.
LEAST_SHARE = 0.1


class Mode(NamedTuple):
    """A pole with its mode shape; of a conjugate pair the one above the real axis.

    Attributes:
        pole: [rad/s].
        frequency: |λ| [rad/s].
        damping: −Re λ/|λ|; 1 for a decay without oscillation.
        shares: share of the kinetic energy per DOF of the bar (6,), then per winch (n,).
        words: what moves, by kinetic energy.
    """

    pole: complex
    frequency: float
    damping: float
    shares: Array
    words: str


def modes(
    model: StateSpace, parameters: PlantParameters, point: OperatingPoint, cables: Sequence[str]
) -> list[Mode]:
    """Return the modes of `linear_model`, slowest first, without those that only drift.

    Args:
        model: of `linear_model`.
        parameters: the machine's kernel parameters.
        point: the model's operating point.
        cables: their names.
    """
    poles, vectors = np.linalg.eig(model.A)
    mass = mass_matrix(parameters, point.bar_pose)
    found = []
    for pole, vector in zip(poles, vectors.T, strict=True):
        if abs(pole) < SLOWEST or pole.imag < 0.0:
            continue
        bar, angles = vector[:6], vector[BAR_STATES : BAR_STATES + len(cables)]
        shares = _energy_shares(bar, angles, mass, parameters.cables[:, cable_kernel.INERTIA])
        words = _words(shares, _stretches(parameters, point, bar, angles), cables)
        found.append(
            Mode(complex(pole), float(abs(pole)), float(-pole.real / abs(pole)), shares, words)
        )
    return sorted(found, key=lambda mode: mode.frequency)


def drifting_poles(model: StateSpace) -> int:
    """Return how many poles are at zero: motions that nothing pulls back."""
    return int(np.sum(np.abs(np.linalg.eigvals(model.A)) < SLOWEST))


def _energy_shares(bar: ComplexArray, angles: ComplexArray, mass: Array, inertia: Array) -> Array:
    energy = np.concatenate([(bar.conj() * (mass @ bar)).real, inertia * np.abs(angles) ** 2])
    return np.asarray(energy / energy.sum())


def _stretches(
    parameters: PlantParameters, point: OperatingPoint, bar: ComplexArray, angles: ComplexArray
) -> Array:
    """Return per cable how much bar and winch agree in stretching it; negative: one gives way."""
    wound = parameters.cables[:, cable_kernel.RADIUS] * angles
    return np.asarray(((point.jacobian @ bar) * wound.conj()).real)


def _words(shares: Array, stretches: Array, cables: Sequence[str]) -> str:
    order = np.argsort(-shares[:6])
    dofs = [DOFS[i] for i in order if shares[i] >= LEAST_SHARE]
    moving = {
        name: "against" if stretches[members].sum() > 0.0 else "with"
        for name, members in cable_groups(cables).items()
        if shares[6:][members].sum() >= LEAST_SHARE
    }
    if not dofs:
        return f"{' and '.join(moving)} winches, the bar nearly still"
    if not moving:
        return f"{' and '.join(dofs)}, the winches nearly still"
    winches = [
        f"{how} {' and '.join(name for name in moving if moving[name] == how)} winches"
        for how in ("against", "with")
        if how in moving.values()
    ]
    return " ".join([" and ".join(dofs), *winches])
