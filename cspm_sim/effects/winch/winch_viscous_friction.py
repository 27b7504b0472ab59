"""Viscous friction of a winch: torque proportional to motor speed."""

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
from cspm_sim.kernels.winch import RESISTANCE, SPEED


def _kernel(parameters: Array, signals: Array) -> None:
    signals[RESISTANCE] += parameters[0] * signals[SPEED]


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, WinchSignal.SPEED, None, None])


EFFECT = Effect(
    id="winch_viscous_friction",
    block=Block.WINCH,
    parameters=(EffectParameter("coefficient", "N·m·s/rad", 0.0, 0.1),),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="viscous friction",
        equation="resisting torque = coefficient·q̇",
        shows="winch torque residual is a straight line through zero against motor speed",
        confounded_with=(
            "winch_coulomb_friction",
            "winch_stribeck_friction",
            "cable_axial_damping",
            "tension_delay",
            "torque_delay",
            "tension_lag",
            "winch_directional_friction",
            "winch_curved_friction",
        ),
        separating_experiment="constant speeds over at least one decade at constant tension",
        reference=(
            "thesis (2-21); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994"
        ),
    ),
)
