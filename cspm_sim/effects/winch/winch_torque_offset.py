"""Constant torque at a winch's shaft that its drive does not report."""

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
from cspm_sim.kernels.winch import RESISTANCE


def _kernel(parameters: Array, signals: Array) -> None:
    signals[RESISTANCE] -= parameters[0]


def _columns(signals: Array) -> Array:
    return np.full((len(signals), 1, 1), -1.0)


EFFECT = Effect(
    id="winch_torque_offset",
    block=Block.WINCH,
    parameters=(EffectParameter("torque", "N·m", -1.0, 1.0),),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="a constant torque",
        equation="torque at the shaft = reported torque + torque: a resisting torque of −torque",
        shows="winch torque residual is shifted by a constant, at rest and in motion either way",
        confounded_with=(
            "winch_torque_gain",
            "tension_bias",
            "winch_drum_radius",
            "winch_directional_friction",
            "winch_unbalance",
        ),
        separating_experiment="hold still at three tension levels: the offset is the same at all",
        reference=(
            "Janot, Gautier, Brunot, EMPS data set, nonlinearbenchmark.org, 2019 (drive offset)"
        ),
    ),
)
