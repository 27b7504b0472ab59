"""Damping of a cable's motion across itself, felt at its end on the bar."""

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Effect,
    EffectParameter,
    Hook,
    Regression,
)
from cspm_sim.effects.signals import EndSignal
from cspm_sim.kernels.bar_effects import END_DIRECTION, END_FORCE, END_VELOCITY


def _kernel(parameters: Array, signals: Array) -> None:
    along = 0.0
    for axis in range(3):
        along += signals[END_DIRECTION + axis] * signals[END_VELOCITY + axis]
    for axis in range(3):
        across = signals[END_VELOCITY + axis] - along * signals[END_DIRECTION + axis]
        signals[END_FORCE + axis] -= parameters[0] * across


def _columns(signals: Array) -> Array:
    direction = signals[:, EndSignal.DIRECTION : EndSignal.DIRECTION + 3]
    velocity = signals[:, EndSignal.VELOCITY : EndSignal.VELOCITY + 3]
    along = np.sum(direction * velocity, axis=1, keepdims=True)
    force = along * direction - velocity
    moment = np.cross(signals[:, EndSignal.ARM : EndSignal.ARM + 3], force)
    return np.hstack([force, moment])[:, :, None]


EFFECT = Effect(
    id="cable_transverse_damping",
    block=Block.CABLE,
    parameters=(EffectParameter("coefficient", "N·s/m", 0.0, 100.0),),
    kernels={Hook.ATTACHMENT: _kernel},
    regression=Regression(Channel.WRENCH, _columns),
    equation=(
        "force on the bar at the attachment = −coefficient·(velocity against the exit, less its"
        " part along the cable)"
    ),
    shows="bar wrench residual in proportion to velocity across a cable; torque and tension silent",
    twins=("bar_linear_damping", "bar_quadratic_drag"),
    separating_experiment="free decay along and across the cables, at two poses of the bar",
    reference="thesis chapter 4, where damping across the cables is named as what the model lacks",
)
