"""An encoder that counts more or less than one turn per turn."""

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Physics,
    Regression,
    Sense,
    Signature,
)
from cspm_sim.effects.signals import ReadingSignal


def _reading(values: Array, element: int, parameters: Array) -> Array:
    read = values.copy()
    # Angles, speeds and torques of all winches follow each other.
    n = len(values) // 3
    read[element] *= parameters[0]
    read[n + element] *= parameters[0]
    return read


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, ReadingSignal.VALUE, None, None])


EFFECT = Effect(
    id="encoder_scale",
    block=Block.SENSOR,
    parameters=(
        EffectParameter(
            "scale", "1", 0.5, 2.0, absent=1.0, meaning="multiplies; 1 is an encoder without error"
        ),
    ),
    physics=Physics(sense=Sense(("/winches/state",), _reading)),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="a scale error of its encoder",
        equation="measured angle and speed = scale·angle, scale·speed",
        shows=(
            "cable length residual is in proportion to the motor angle, torque residual silent, as"
            " of a wrong drum radius whose torque a wrong gain of torque or tension makes up for"
        ),
        confounded_with=("winch_drum_radius", "cable_stiffness"),
        separating_experiment="wind several metres at constant tension and hold known weights",
        reference="counts per turn of an incremental encoder set wrong",
    ),
)
