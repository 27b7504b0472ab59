"""Dry friction of a winch that falls from breakaway to Coulomb torque as the speed rises."""

from math import exp

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Hook,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.kernels.winch import DRY_LIMIT, SPEED


def _kernel(parameters: Array, signals: Array) -> None:
    ratio = signals[SPEED] / parameters[2]
    near_rest = exp(-ratio * ratio)
    signals[DRY_LIMIT] += parameters[1] + (parameters[0] - parameters[1]) * near_rest


def _columns(signals: Array, stribeck_speed: float) -> Array:
    speed = signals[:, WinchSignal.SPEED]
    near_rest = np.exp(-((speed / stribeck_speed) ** 2))
    return np.asarray(np.sign(speed)[:, None] * np.stack([near_rest, 1.0 - near_rest], -1))[:, None]


# Of breakaway: what falls further while it slides is no dry friction (Armstrong-Hélouvry et al.).
_LEAST_LEFT = 0.5


def _falls(values: Values) -> bool:
    breakaway, coulomb = values["breakaway_torque"], values["coulomb_torque"]
    return _LEAST_LEFT * breakaway <= coulomb <= breakaway


EFFECT = Effect(
    id="winch_stribeck_friction",
    block=Block.WINCH,
    parameters=(
        EffectParameter("breakaway_torque", "N·m", 0.0, 1.0),
        EffectParameter("coulomb_torque", "N·m", 0.0, 1.0),
        EffectParameter("stribeck_speed", "rad/s", 1e-2, 1e3, absent=None),
    ),
    physics=Physics(
        kernels={Hook.WINCH: _kernel},
        plausible=_falls,
    ),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        nonlinear={"stribeck_speed": (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)},
    ),
    description=Description(
        noun="dry friction with a larger breakaway torque",
        equation=(
            "resisting torque = (coulomb + (breakaway −"
            " coulomb)·exp(−(q̇/stribeck_speed)²))·sign(q̇); at q̇ = 0 whatever holds, up to"
            " breakaway"
        ),
        shows=(
            "winch torque residual peaks on both sides of each reversal and falls to a constant; to"
            " less than half is not called dry friction"
        ),
        confounded_with=("winch_coulomb_friction", "winch_viscous_friction"),
        separating_experiment="slow reversals with speeds from well below to above stribeck_speed",
        reference=(
            "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994 (Gaussian form)"
        ),
    ),
)
