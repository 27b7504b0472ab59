"""A drum that turns about a point beside its centre."""

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
from cspm_sim.effects.signals import CableSignal, WinchSignal
from cspm_sim.kernels.affected_cables import DRUM_GEAR, MOTOR_ANGLE, RADIUS_ADDED


def _kernel(parameters: Array, signals: Array) -> None:
    gear = signals[DRUM_GEAR]
    signals[RADIUS_ADDED] += parameters[0] / gear * cos(signals[MOTOR_ANGLE] / gear + parameters[1])


def _torque(signals: Array) -> Array:
    gear = signals[:, WinchSignal.GEAR]
    drum = signals[:, WinchSignal.ANGLE] / gear
    load = (signals[:, WinchSignal.TENSION] / gear)[:, None]
    return np.asarray(load * np.stack([np.cos(drum), -np.sin(drum)], -1))[:, None]


def _tension(signals: Array) -> Array:
    gear = signals[:, CableSignal.GEAR]
    drum, turning = signals[:, CableSignal.ANGLE] / gear, signals[:, CableSignal.SPEED] / gear
    wound = np.stack([np.sin(drum) - np.sin(drum[0]), np.cos(drum) - np.cos(drum[0])], -1)
    winding = np.stack([np.cos(drum), -np.sin(drum)], -1) * turning[:, None]
    pulled = signals[:, CableSignal.STIFFNESS, None] * wound
    damped = signals[:, CableSignal.DAMPING, None] * winding
    return np.asarray(signals[:, CableSignal.WOUND, None] * (pulled + damped))[:, None]


def _weights(values: Values) -> tuple[float, float]:
    eccentricity, phase = values["eccentricity"], values["phase"]
    return eccentricity * cos(phase), eccentricity * sin(phase)


def _values(weights: Sequence[float], _: Values) -> dict[str, float]:
    return {"eccentricity": hypot(*weights), "phase": atan2(weights[1], weights[0])}


EFFECT = Effect(
    id="winch_drum_eccentricity",
    block=Block.WINCH,
    parameters=(
        EffectParameter("eccentricity", "m", 0.0, 0.01),
        EffectParameter("phase", "rad", -pi, pi, absent=None),
    ),
    physics=Physics(kernels={Hook.CABLE: _kernel}),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _torque),
        partners=(Regression(Channel.TENSION, _tension),),
        coefficients=_weights,
        from_coefficients=_values,
    ),
    description=Description(
        noun="an eccentric drum",
        equation="winding radius = r + eccentricity·cos(q/n + phase), in torque and cable alike",
        shows=(
            "a line at one per turn of the drum in torque, in proportion to tension, and a quarter"
            " turn behind it in the cable's length"
        ),
        confounded_with=("winch_torque_ripple", "winch_unbalance"),
        separating_experiment="several turns of the drum at constant speed, at two tension levels",
        reference="geometry; thesis (2-16) and (2-21) with a radius that changes",
    ),
)
