"""Drag of still air or water on the bar, in world axes, at the bar frame's origin."""

from math import sqrt

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
    for first in (0, 3):
        x, y, z = VELOCITY + first, VELOCITY + first + 1, VELOCITY + first + 2
        speed = sqrt(signals[x] ** 2 + signals[y] ** 2 + signals[z] ** 2)
        for axis in range(first, first + 3):
            signals[WRENCH + axis] -= parameters[axis] * speed * signals[VELOCITY + axis]


def _columns(signals: Array) -> Array:
    velocity = signals[:, BarSignal.VELOCITY : BarSignal.VELOCITY + 6]
    speed = np.linalg.norm(velocity.reshape(-1, 2, 3), axis=2).repeat(3, axis=1)
    return np.asarray(-(speed * velocity)[:, :, None] * np.eye(6))


EFFECT = Effect(
    id="bar_quadratic_drag",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(axis, "N·s²/m²" if i < 3 else "N·m·s²/rad²", 0.0, 100.0)
        for i, axis in enumerate(DOFS)
    ),
    physics=Physics(kernels={Hook.BAR: _kernel}),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="drag with the square of speed",
        equation=(
            "force on the bar = −coefficient·|v|·v and moment = −coefficient·|ω|·ω in world_ned, a"
            " coefficient per axis, |v| and |ω| being those of all three axes together"
        ),
        shows=(
            "bar wrench residual is a parabola of both signs against the same axis's velocity,"
            " steeper while the other axes move"
        ),
        confounded_with=("bar_linear_damping", "cable_transverse_damping"),
        separating_experiment=(
            "free decay at two amplitudes: the decrement grows with the amplitude"
        ),
        reference="Morison drag without added mass, DNV-RP-C205 chapter 6",
    ),
)
