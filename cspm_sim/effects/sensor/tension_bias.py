"""A load cell whose zero is off."""

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


def _reading(values: Array, element: int, parameters: Array) -> Array:
    read = values.copy()
    read[element] += parameters[0]
    return read


def _columns(signals: Array) -> Array:
    return np.ones((len(signals), 1, 1))


EFFECT = Effect(
    id="tension_bias",
    block=Block.SENSOR,
    parameters=(EffectParameter("bias", "N", -100.0, 100.0),),
    physics=Physics(sense=Sense(("/cables/tension",), _reading)),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="a zero offset",
        equation="measured tension = tension + bias",
        shows="the same constant in torque, tension and wrench residuals of one cable",
        confounded_with=(
            "winch_torque_offset",
            "bar_constant_wrench",
            "tension_crosstalk",
            "tension_drift",
        ),
        separating_experiment="read the cell with its cable slack, and at three tension levels",
        reference="zero balance of strain-gauge load cells, OIML R 60",
    ),
)
