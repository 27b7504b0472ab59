"""Oil that a winch's gear churns: torque with the square of the speed."""

import numpy as np

from cspm_sim.effects import (
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


def _kernel(parameters, signals):
    # parameters in the order below; signals are those of the hook.
    signals[RESISTANCE] += parameters[0] * abs(signals[SPEED]) * signals[SPEED]


def _columns(signals):
    # (samples, channels, coefficients): what one unit of the coefficient adds to the residual.
    speed = signals[:, WinchSignal.SPEED, None, None]
    return np.abs(speed) * speed


EFFECT = Effect(
    id="winch_churning",
    block=Block.WINCH,
    parameters=(EffectParameter("coefficient", "N·m·s²/rad²", 0.0, 1.0),),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="oil that churns",
        equation="resisting torque = coefficient·|q̇|·q̇",
        shows="winch torque residual is a parabola to either side against motor speed",
        confounded_with=("winch_viscous_friction",),
        separating_experiment="constant speeds over at least one decade at constant tension",
        reference="Seetharaman, Kahraman, Journal of Tribology 131(2), 2009",
    ),
)
