"""A load cell whose sensitivity is off."""

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
    read[element] *= parameters[0]
    return read


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, ReadingSignal.VALUE, None, None])


EFFECT = Effect(
    id="tension_gain",
    block=Block.SENSOR,
    parameters=(
        EffectParameter(
            "gain", "1", 0.5, 2.0, absent=1.0, meaning="multiplies; 1 is a cell without error"
        ),
    ),
    physics=Physics(sense=Sense(("/cables/tension",), _reading)),
    signature=Signature(regression=Regression(Channel.READING, _columns), rescales=True),
    description=Description(
        noun="a scale error",
        equation="measured tension = gain·tension",
        shows="the same share of the tension in torque, tension and wrench residuals of one cable",
        confounded_with=(
            "winch_torque_gain",
            "winch_drum_radius",
            "cable_stiffness",
            "bar_mass",
            "tension_crosstalk",
        ),
        separating_experiment="hang a known mass on the bar, and hold it with known torques",
        reference="rated output of strain-gauge load cells, OIML R 60",
    ),
)
