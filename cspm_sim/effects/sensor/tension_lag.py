"""Load cells behind a low-pass filter of first order, which loses gain as well as time."""

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Elements,
    Physics,
    Regression,
    Sense,
    Signature,
)
from cspm_sim.effects.signals import ReadingSignal


def _time_constant(parameters: Array) -> float:
    return float(parameters[0])


def _columns(signals: Array) -> Array:
    return np.asarray(-signals[:, ReadingSignal.RATE, None, None])


EFFECT = Effect(
    id="tension_lag",
    block=Block.SENSOR,
    parameters=(EffectParameter("time_constant", "s", 0.0, 1.0),),
    elements=Elements.CELLS,
    physics=Physics(
        sense=Sense(("/cables/tension",), time_constant=_time_constant, one_system=True)
    ),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="a low-pass filter",
        equation="time_constant·d(measured tension)/dt = tension − measured tension",
        shows=(
            "residuals as of a delay where motions are slow against the time constant; above, the"
            " reading falls with the frequency as well"
        ),
        confounded_with=("tension_delay", "winch_viscous_friction"),
        separating_experiment=(
            "sweep the frequency up to the inverse of 2π·time_constant: a delay keeps the amplitude"
        ),
        reference="first-order low pass, Franklin, Powell, Emami-Naeini, Feedback Control, 2019",
    ),
)
