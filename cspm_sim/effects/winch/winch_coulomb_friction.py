"""Coulomb friction of a winch: constant torque against the motion, sticking at standstill."""

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
)
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.kernels.winch import DRY_LIMIT


def _kernel(parameters: Array, signals: Array) -> None:
    signals[DRY_LIMIT] += parameters[0]


def _columns(signals: Array) -> Array:
    return np.asarray(np.sign(signals[:, WinchSignal.SPEED, None, None]))


EFFECT = Effect(
    id="winch_coulomb_friction",
    block=Block.WINCH,
    parameters=(EffectParameter("torque", "N·m", 0.0, 1.0),),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="dry friction",
        equation="resisting torque = torque·sign(q̇); at q̇ = 0 whatever holds, up to torque",
        shows=(
            "winch torque residual steps by twice the torque at each reversal, flat against speed"
        ),
        confounded_with=(
            "winch_load_friction",
            "winch_stribeck_friction",
            "winch_viscous_friction",
            "pulley_friction",
            "winch_curved_friction",
        ),
        separating_experiment="slow reversals at two or more tension levels",
        reference=(
            "thesis (2-21); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994"
        ),
    ),
)
