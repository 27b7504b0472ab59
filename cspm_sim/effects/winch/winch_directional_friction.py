"""Difference of a winch's friction between its two directions, which grows with the speed."""

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
    signals[RESISTANCE] += parameters[0] * abs(signals[SPEED])


def _columns(signals: Array) -> Array:
    return np.abs(signals[:, WinchSignal.SPEED, None, None])


EFFECT = Effect(
    id="winch_directional_friction",
    block=Block.WINCH,
    parameters=(
        EffectParameter(
            "coefficient",
            "N·m·s/rad",
            -0.1,
            0.1,
            meaning="half of that while winding in less that while paying out",
        ),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="friction that differs by direction",
        equation="resisting torque = coefficient·|q̇|, beside viscous friction of at least as much",
        shows=(
            "winch torque residual is two straight lines of opposite slopes that meet at zero; dry"
            " friction that differs by direction shows as dry friction and a torque offset instead"
        ),
        confounded_with=("winch_viscous_friction", "winch_torque_offset"),
        separating_experiment="the same constant speeds in both directions at constant tension",
        reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, section 2",
    ),
)
