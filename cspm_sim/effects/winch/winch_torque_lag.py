"""A drive that delivers, and reports, its torque with a first-order lag."""

from collections.abc import Sequence

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
from cspm_sim.kernels.winch import COMMANDED_TORQUE, REPORTED_TORQUE, WINCH_TENSION, WINDING_RADIUS


def _kernel(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    rates[0] = (signals[COMMANDED_TORQUE] - states[0]) / parameters[0]
    signals[REPORTED_TORQUE] = states[0]


def _rest(parameters: Array, signals: Array) -> Sequence[float]:
    return (signals[WINCH_TENSION] * signals[WINDING_RADIUS],)


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, WinchSignal.TORQUE_RATE, None, None])


EFFECT = Effect(
    id="winch_torque_lag",
    block=Block.WINCH,
    parameters=(
        EffectParameter(
            "time_constant", "s", 5e-4, 1.0, absent=None, meaning="less is less than a step"
        ),
    ),
    physics=Physics(
        kernels={Hook.DRIVE: _kernel},
        states=1,
        rest=_rest,
    ),
    signature=Signature(regression=Regression(Channel.DRIVE, _columns)),
    description=Description(
        noun="a lag of its drive",
        equation="time_constant·d(reported torque)/dt = commanded torque − reported torque",
        shows="commanded less reported torque is in proportion to the rate of the reported one",
        confounded_with=("winch_inertia", "pose_delay", "torque_delay"),
        separating_experiment="torque steps with the winch locked, and a sweep of frequencies",
        reference="Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems, chapter 3",
    ),
)
