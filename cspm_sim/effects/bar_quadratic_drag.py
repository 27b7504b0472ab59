"""Drag of still air or water on the bar, in world axes, at the bar frame's origin."""

import numpy as np

from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Effect,
    EffectParameter,
    Hook,
    Regression,
)
from cspm_sim.effects.signals import BarSignal
from cspm_sim.kernels.bar import VELOCITY, WRENCH


def _kernel(parameters: Array, signals: Array) -> None:
    for axis in range(6):
        velocity = signals[VELOCITY + axis]
        signals[WRENCH + axis] -= parameters[axis] * abs(velocity) * velocity


def _columns(signals: Array) -> Array:
    velocity = signals[:, BarSignal.VELOCITY : BarSignal.VELOCITY + 6]
    return np.asarray(-(np.abs(velocity) * velocity)[:, :, None] * np.eye(6))


EFFECT = Effect(
    id="bar_quadratic_drag",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(axis, "N·s²/m²" if i < 3 else "N·m·s²/rad²", 0.0, 100.0)
        for i, axis in enumerate(DOFS)
    ),
    kernels={Hook.BAR: _kernel},
    regression=Regression(Channel.WRENCH, _columns),
    equation="wrench on the bar = −coefficient·|velocity|·velocity, axis by axis in world_ned",
    shows="bar wrench residual is a parabola of both signs against the same axis's velocity",
    twins=("bar_linear_damping", "cable_transverse_damping"),
    separating_experiment="free decay at two amplitudes: the decrement grows with the amplitude",
    reference="Morison drag without added mass, DNV-RP-C205 chapter 6",
)
