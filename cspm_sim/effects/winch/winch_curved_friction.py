"""Friction of a winch that bulges over the straight line of dry and viscous friction."""

from math import sqrt

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
from cspm_sim.kernels.winch import DRY_LIMIT, RESISTANCE, SPEED


def _kernel(parameters: Array, signals: Array) -> None:
    share = abs(signals[SPEED]) / parameters[1]
    value = parameters[0] * (sqrt(share) - share)
    # As a limit of dry friction it stays against the motion, however steep it is at rest.
    if value > 0.0:
        signals[DRY_LIMIT] += value
    elif signals[SPEED] > 0.0:
        signals[RESISTANCE] += value
    else:
        signals[RESISTANCE] -= value


def _columns(signals: Array, speed: float) -> Array:
    turned = signals[:, WinchSignal.SPEED, None, None]
    share = np.abs(turned) / speed
    return np.asarray(np.sign(turned) * (np.sqrt(share) - share))


EFFECT = Effect(
    id="winch_curved_friction",
    block=Block.WINCH,
    parameters=(
        EffectParameter("torque", "N·m", 0.0, 1.0, meaning="four times the height of the bulge"),
        EffectParameter(
            "speed", "rad/s", 1.0, 1e3, absent=None, meaning="at which the straight line is back"
        ),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        nonlinear={"speed": (100.0,)},
    ),
    description=Description(
        noun="friction that curves at low speed",
        equation="resisting torque = torque·(√(|q̇|/speed) − |q̇|/speed)·sign(q̇)",
        shows=(
            "winch torque residual bulges between rest and the speed over the straight line of dry"
            " and viscous friction, which a root of the speed makes beside them"
        ),
        confounded_with=("winch_coulomb_friction", "winch_viscous_friction"),
        separating_experiment="constant speeds over two decades at constant tension, both ways",
        reference="Palmgren, Ball and Roller Bearing Engineering, 3rd ed., 1959 (roots of speed)",
    ),
)
