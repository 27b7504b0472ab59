"""A load cell whose zero wanders, as with its temperature."""

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
    return float(parameters[0] * time)


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, ReadingSignal.TIME, None, None])


EFFECT = Effect(
    id="tension_drift",
    block=Block.SENSOR,
    parameters=(EffectParameter("rate", "N/s", -1.0, 1.0),),
    physics=Physics(sense=Sense(("/cables/tension",), added=_added)),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="a drift",
        equation="measured tension = tension + rate·τ, τ from the run's start",
        shows=(
            "torque, tension and wrench residuals of one cable grow evenly with time, whatever the"
            " motion"
        ),
        confounded_with=("tension_bias", "cable_creep"),
        separating_experiment=(
            "hold still for minutes, and read the cell with its cable slack before and after"
        ),
        reference="temperature effect on the zero of strain-gauge load cells, OIML R 60",
    ),
)
