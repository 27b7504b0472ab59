"""Linear damping of the bar's motion, in world axes, at the bar frame's origin."""

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
from cspm_sim.effects.signals import BarSignal
from cspm_sim.kernels.bar_effects import VELOCITY, WRENCH


def _kernel(parameters: Array, signals: Array) -> None:
    for axis in range(6):
        signals[WRENCH + axis] -= parameters[axis] * signals[VELOCITY + axis]


def _columns(signals: Array) -> Array:
    first = BarSignal.VELOCITY
    return np.asarray(-signals[:, first : first + 6, None] * np.eye(6))


EFFECT = Effect(
    id="bar_linear_damping",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(axis, "N·s/m" if i < 3 else "N·m·s/rad", 0.0, 100.0)
        for i, axis in enumerate(DOFS)
    ),
    physics=Physics(kernels={Hook.BAR: _kernel}),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="drag in proportion to speed",
        equation="wrench on the bar = −coefficient·velocity, axis by axis in world_ned",
        shows=(
            "bar wrench residual is a straight line through zero against the same axis's velocity"
        ),
        confounded_with=("cable_transverse_damping", "bar_quadratic_drag", "cable_axial_damping"),
        separating_experiment="free decay at two amplitudes, and along and across the cables",
        reference="thesis chapter 4, where damping on the bar is named as what the model lacks",
    ),
)
