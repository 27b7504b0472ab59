"""A winch whose shaft gets another multiple of the torque than its drive reports."""

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
from cspm_sim.kernels.winch import REPORTED_TORQUE, RESISTANCE


def _kernel(parameters: Array, signals: Array) -> None:
    signals[RESISTANCE] -= (parameters[0] - 1.0) * signals[REPORTED_TORQUE]


def _columns(signals: Array) -> Array:
    return np.asarray(-signals[:, WinchSignal.TORQUE, None, None])


EFFECT = Effect(
    id="winch_torque_gain",
    block=Block.WINCH,
    parameters=(
        EffectParameter(
            "gain", "1", 0.5, 2.0, absent=1.0, meaning="multiplies; 1 is a drive without error"
        ),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns), rescales=True),
    description=Description(
        noun="a scale error of its torque",
        equation="torque at the shaft = gain·reported torque",
        shows=(
            "winch torque residual is in proportion to the reported torque, at rest and in motion"
        ),
        confounded_with=("tension_gain", "winch_drum_radius", "winch_torque_offset"),
        separating_experiment="hold known weights, then accelerate a winch with its cable slack",
        reference="Gautier, Briot, ASME J. Dynamic Systems, Measurement, Control 136(5), 2014",
    ),
)
