"""A constant force and moment on the bar, in world axes, at the bar frame's origin."""

import numpy as np

from cspm_msgs_py.dofs import DOFS
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
from cspm_sim.kernels.bar_effects import WRENCH


def _kernel(parameters: Array, signals: Array) -> None:
    for axis in range(6):
        signals[WRENCH + axis] += parameters[axis]


def _columns(signals: Array) -> Array:
    return np.tile(np.eye(6), (len(signals), 1, 1))


EFFECT = Effect(
    id="bar_constant_wrench",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(axis, "N" if i < 3 else "N·m", -200.0, 200.0) for i, axis in enumerate(DOFS)
    ),
    physics=Physics(kernels={Hook.BAR: _kernel}),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="a constant wrench from outside",
        equation="wrench on the bar in world_ned = the six numbers",
        shows="bar wrench residual is shifted by a constant at all poses and speeds",
        confounded_with=("bar_mass", "bar_com", "tension_bias", "bar_restoring"),
        separating_experiment="hold still at three poses, turned and unturned, then accelerate",
        reference="a steady wind or a cable that drags; Newton and Euler, thesis (2-12)",
    ),
)
