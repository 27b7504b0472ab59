"""Damping of a cable's motion across itself, felt at its end on the bar."""

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
from cspm_sim.effects.signals import EndSignal
from cspm_sim.kernels.bar_effects import END_DIRECTION, END_EXIT_VELOCITY, END_FORCE, END_VELOCITY


def _kernel(parameters: Array, signals: Array) -> None:
    carried = 1.0 - parameters[1]
    along = 0.0
    for axis in range(3):
        velocity = signals[END_VELOCITY + axis] + carried * signals[END_EXIT_VELOCITY + axis]
        along += signals[END_DIRECTION + axis] * velocity
    for axis in range(3):
        velocity = signals[END_VELOCITY + axis] + carried * signals[END_EXIT_VELOCITY + axis]
        across = velocity - along * signals[END_DIRECTION + axis]
        signals[END_FORCE + axis] -= parameters[0] * across


def _columns(signals: Array, exit_share: float) -> Array:
    direction = signals[:, EndSignal.DIRECTION : EndSignal.DIRECTION + 3]
    exits = signals[:, EndSignal.EXIT_VELOCITY : EndSignal.EXIT_VELOCITY + 3]
    velocity = signals[:, EndSignal.VELOCITY : EndSignal.VELOCITY + 3] + (1.0 - exit_share) * exits
    along = np.sum(direction * velocity, axis=1, keepdims=True)
    force = along * direction - velocity
    moment = np.cross(signals[:, EndSignal.ARM : EndSignal.ARM + 3], force)
    return np.hstack([force, moment])[:, :, None]


EFFECT = Effect(
    id="cable_transverse_damping",
    block=Block.CABLE,
    parameters=(
        EffectParameter("coefficient", "N·s/m", 0.0, 100.0),
        EffectParameter(
            "exit_share",
            "1",
            -1.0,
            1.0,
            absent=None,
            default=1.0,
            meaning="of the exit's velocity that is taken off: 1 what bends at the exit, −0.5 a"
            " rope that drags through still air",
        ),
    ),
    physics=Physics(kernels={Hook.ATTACHMENT: _kernel}),
    signature=Signature(
        regression=Regression(Channel.WRENCH, _columns),
        nonlinear={"exit_share": (-0.5, 1.0)},
    ),
    description=Description(
        noun="damping across it",
        equation=(
            "force on the bar at the attachment = −coefficient·(velocity − exit_share·velocity of"
            " the exit, less its part along the cable)"
        ),
        shows=(
            "bar wrench residual in proportion to velocity across a cable; torque and tension"
            " silent"
        ),
        confounded_with=("bar_linear_damping", "bar_quadratic_drag"),
        separating_experiment="free decay along and across the cables, at two poses of the bar",
        reference=(
            "thesis chapter 4, where damping across the cables is named as what the model lacks;"
            " −0.5 is a straight rope's drag in proportion to its speed, shared between its ends"
        ),
    ),
)
