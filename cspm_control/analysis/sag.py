"""How cables with weight hold the bar at rest, beside straight ones without."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.catenary import HangingCable, ernst_share, hang
from cspm_model.equilibrium import NOTHING, Equilibrium, find_equilibrium
from cspm_model.kernels.cable import ATTACHMENT, EXIT, OFFSET_LENGTH
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import rotation
from cspm_model.linearisation import operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.scenario_keys.bodies import ORIGIN
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# Tensions settle as the share of a cable's weight in its tension, to the power of the rounds.
_ROUNDS = 50
_SETTLED = 1e-9


class SaggingCable(NamedTuple):
    """One cable at rest.

    Attributes:
        name: of the cable.
        straight: tension of a straight cable without weight [N].
        tension: at the exit, with weight [N].
        end_tension: at the attachment, with weight [N].
        sag: largest distance from the straight line [m].
        longer: unstretched length against that of a straight cable of the same tension [m].
        stiffness: share of the axial stiffness that sag leaves, by Ernst's modulus.
    """

    name: str
    straight: float
    tension: float
    end_tension: float
    sag: float
    longer: float
    stiffness: float


def sagging_cables(
    testbed: Testbed, pose: Sequence[float], densities: Array
) -> tuple[SaggingCable, ...]:
    """Return the cables of a machine at rest, with the winch frame at the origin.

    Args:
        testbed: the machine; its effects are left out.
        pose: of the bar, x y z φ θ ψ [m, rad].
        densities: of the cables (n,), above 0 [kg/m].

    Raises:
        InputError: a cable runs over a pulley or in several parts.
        ConvergenceError: no tensions within the limits hold bar and cables.
    """
    parameters = nominal_parameters(testbed)
    _check_straight(testbed)
    limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
    straight = operating_point(testbed, parameters, pose)
    elastic = straight.unstretched_lengths + parameters.cables[:, OFFSET_LENGTH]
    rigidity, weights = straight.stiffness * elastic, densities * testbed.gravity
    found, hung = _settle(testbed, parameters, pose, limits, (weights, rigidity))
    apart, _ = _ends(parameters, found.bar_pose)
    across = np.hypot(apart[:, 0], apart[:, 1])
    without = np.linalg.norm(apart, axis=1) / (1.0 + found.tensions / rigidity)
    return tuple(
        SaggingCable(
            cable.name,
            float(straight.tensions[i]),
            float(found.tensions[i]),
            float(np.hypot(each.horizontal, each.end_pull)),
            each.sag,
            float(each.unstretched - without[i]),
            ernst_share(across[i], float(found.tensions[i]), weights[i], rigidity[i]),
        )
        for i, (cable, each) in enumerate(zip(testbed.cables, hung, strict=True))
    )


def _settle(
    testbed: Testbed,
    parameters: PlantParameters,
    pose: Sequence[float],
    limits: Array,
    material: tuple[Array, Array],
) -> tuple[Equilibrium, list[HangingCable]]:
    """Return the state of rest at which the cables' own weight is carried too."""
    load = NOTHING
    for _ in range(_ROUNDS):
        found = find_equilibrium(parameters, pose, ORIGIN, limits, load)
        apart, arms = _ends(parameters, found.bar_pose)
        hung = [
            _hung(cable.name, apart[i], found.tensions[i], material[0][i], material[1][i])
            for i, cable in enumerate(testbed.cables)
        ]
        before, load = load, _load(apart, arms, found.tensions, hung)
        if np.abs(load - before).max() <= _SETTLED * max(float(found.tensions.max()), 1.0):
            return found, hung
    raise ConvergenceError(
        f"{testbed.name}: tensions do not settle in {_ROUNDS} rounds, allowed: lighter cables or"
        " higher tensions"
    )


def _hung(name: str, apart: Array, tension: float, weight: float, rigidity: float) -> HangingCable:
    across = float(np.hypot(apart[0], apart[1]))
    try:
        return hang(across, float(apart[2]), float(tension), float(weight), float(rigidity))
    except ConvergenceError as err:
        raise ConvergenceError(f"{name}: {err}") from None


def _load(apart: Array, arms: Array, tensions: Array, hung: Sequence[HangingCable]) -> Array:
    """Return the wrench on the bar beyond that of straight cables of the same tensions, (6,)."""
    wrench = np.zeros(6)
    for way, arm, tension, each in zip(apart, arms, tensions, hung, strict=True):
        level = np.hypot(way[0], way[1])
        level_pull = -each.horizontal / level * way[:2] if level > 0.0 else np.zeros(2)
        force = np.array([*level_pull, -each.end_pull])
        force += tension / np.linalg.norm(way) * way
        wrench += np.concatenate([force, np.cross(arm, force)])
    return wrench


def _ends(parameters: PlantParameters, pose: Array) -> tuple[Array, Array]:
    """Return vectors from exits to attachments, and from the bar's origin there, (n, 3) [m]."""
    cables = parameters.cables
    arms = cables[:, ATTACHMENT : ATTACHMENT + 3] @ rotation(pose).T
    return pose[:3] + arms - cables[:, EXIT : EXIT + 3], arms


def _check_straight(testbed: Testbed) -> None:
    for cable in testbed.cables:
        if not cable.is_straight:
            raise InputError(
                f"{testbed.name}: {cable.name} has a pulley or several parts, allowed: straight"
                " cables of one part"
            )
