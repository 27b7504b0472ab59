"""A load cell that reads a share of its neighbours, as over the ground of a common amplifier."""

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


def _added(time: float, values: Array, element: int, parameters: Array) -> float:
    others = len(values) - 1
    return float(parameters[0] * (values.sum() - values[element]) / max(1, others))


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, ReadingSignal.OTHERS, None, None])


EFFECT = Effect(
    id="tension_crosstalk",
    block=Block.SENSOR,
    parameters=(
        EffectParameter("share", "1", -0.5, 0.5, meaning="of the mean of all other tensions"),
    ),
    physics=Physics(sense=Sense(("/cables/tension",), added=_added)),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="crosstalk",
        equation="measured tension = tension + share·(mean tension of all other cables)",
        shows="torque, tension and wrench residuals of one cable follow the tensions of the others",
        confounded_with=("tension_bias", "tension_gain"),
        separating_experiment="load one of the other cables after the other, with this one slack",
        reference="common-impedance coupling, Ott, Electromagnetic Compatibility Engineering, 2009",
    ),
)
