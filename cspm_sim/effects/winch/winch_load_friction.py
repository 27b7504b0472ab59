"""Dry friction of a winch in proportion to the load that it carries."""

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
from cspm_sim.kernels.winch import DRY_LIMIT, WINCH_TENSION, WINDING_RADIUS


def _kernel(parameters: Array, signals: Array) -> None:
    signals[DRY_LIMIT] += parameters[0] * abs(signals[WINCH_TENSION]) * signals[WINDING_RADIUS]


def _columns(signals: Array) -> Array:
    load = np.abs(signals[:, WinchSignal.TENSION]) * signals[:, WinchSignal.RADIUS]
    return np.asarray((load * np.sign(signals[:, WinchSignal.SPEED]))[:, None, None])


EFFECT = Effect(
    id="winch_load_friction",
    block=Block.WINCH,
    parameters=(EffectParameter("coefficient", "1", 0.0, 0.5),),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="friction in proportion to tension",
        equation=(
            "resisting torque = coefficient·|t|·(r/n)·sign(q̇); at q̇ = 0 whatever holds, up to it"
        ),
        shows="winch torque residual steps at each reversal, in proportion to the tension there",
        confounded_with=("winch_coulomb_friction", "pulley_friction"),
        separating_experiment=(
            "slow reversals at two tension levels, and at two wraps of the pulley"
        ),
        reference="Bittencourt, Wernholt, Sander-Tavallaey, Brogårdh, IROS 2010: friction and load",
    ),
)
