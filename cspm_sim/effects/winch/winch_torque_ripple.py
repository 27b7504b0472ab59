"""Torque at a winch's shaft that comes and goes with its angle: cogging, ripple, gear mesh."""

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, sin

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
    Values,
)
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.kernels.winch import ANGLE, RESISTANCE


def _kernel(parameters: Array, signals: Array) -> None:
    signals[RESISTANCE] -= parameters[0] * sin(parameters[1] * signals[ANGLE] + parameters[2])


def _columns(signals: Array, order: float) -> Array:
    turned = order * signals[:, WinchSignal.ANGLE]
    # Column by column in memory: a long recording has these of many orders.
    both = np.empty((2, len(turned)))
    np.sin(turned, out=both[0])
    np.cos(turned, out=both[1])
    return np.negative(both, out=both).T[:, None]


def _weights(values: Values) -> tuple[float, float]:
    amplitude, phase = values["amplitude"], values["phase"]
    return amplitude * cos(phase), amplitude * sin(phase)


def _values(weights: Sequence[float], nonlinear: Values) -> dict[str, float]:
    amplitude, phase = hypot(*weights), atan2(weights[1], weights[0])
    return {"amplitude": amplitude, "order": nonlinear["order"], "phase": phase}


EFFECT = Effect(
    id="winch_torque_ripple",
    block=Block.WINCH,
    parameters=(
        EffectParameter("amplitude", "N·m", 0.0, 1.0),
        EffectParameter("order", "1", 0.0, 1000.0, absent=None, meaning="per turn of the motor"),
        EffectParameter("phase", "rad", -pi, pi, absent=None),
    ),
    physics=Physics(kernels={Hook.WINCH: _kernel}),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        nonlinear={"order": (*range(1, 25), 26, 28, 30, 32, 36, 40, 42, 44, 48)},
        whole=("order",),
        coefficients=_weights,
        from_coefficients=_values,
    ),
    description=Description(
        noun="torque ripple",
        equation="torque at the shaft = reported torque + amplitude·sin(order·q + phase)",
        shows=(
            "winch torque residual has a line at a fixed order of the motor angle, none in tension"
        ),
        confounded_with=("winch_drum_eccentricity", "winch_unbalance"),
        separating_experiment="several turns at constant speed, at two tension levels",
        reference="Holtz, Springob, IEEE Trans. Industrial Electronics 43(2), 1996",
    ),
)
