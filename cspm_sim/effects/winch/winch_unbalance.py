"""Weight that turns with a winch's drum, or with a joint: a torque once or twice per turn."""

from math import cos, sin

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
from cspm_sim.kernels.winch import ANGLE, MOTOR_GEAR, RESISTANCE


def _kernel(parameters: Array, signals: Array) -> None:
    turned = parameters[2] * signals[ANGLE] / signals[MOTOR_GEAR]
    signals[RESISTANCE] += parameters[0] * cos(turned) + parameters[1] * sin(turned)


def _columns(signals: Array, order: float) -> Array:
    turned = order * signals[:, WinchSignal.ANGLE] / signals[:, WinchSignal.GEAR]
    return np.asarray(np.stack([np.cos(turned), np.sin(turned)], -1)[:, None])


EFFECT = Effect(
    id="winch_unbalance",
    block=Block.WINCH,
    parameters=(
        EffectParameter("cosine", "N·m", -1.0, 1.0),
        EffectParameter("sine", "N·m", -1.0, 1.0),
        EffectParameter("order", "1", 0.0, 100.0, absent=None, meaning="per turn of the drum"),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        nonlinear={"order": (1, 2, 3, 4, 5, 6)},
        whole=("order",),
    ),
    description=Description(
        noun="a load that turns with the drum",
        equation="resisting torque = cosine·cos(order·q/n) + sine·sin(order·q/n)",
        shows=(
            "winch torque residual is a wave of whole order against the drum's angle, at any speed"
            " and tension; one order of the Fourier series of gravity on an arm"
        ),
        confounded_with=("winch_torque_ripple", "winch_torque_offset", "winch_drum_eccentricity"),
        separating_experiment="at least half a turn of the drum, slowly, at two tension levels",
        reference="Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, section 7.3 (gravity)",
    ),
)
