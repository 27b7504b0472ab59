"""More or less stretching cable than the test-bed file says, such as between drum and exit."""

import numpy as np

from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.alteration import altered_cable
from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import CableSignal


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    length = testbed.cables[element].offset_length + values["offset"]
    return altered_cable(testbed, element, offset_length=length)


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, CableSignal.LENGTH_SLOPE, None, None])


EFFECT = Effect(
    id="cable_length_offset",
    block=Block.CABLE,
    parameters=(
        EffectParameter("offset", "m", -10.0, 10.0, meaning="added to offset_length", usual=0.01),
    ),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.TENSION, _columns)),
    description=Description(
        noun="length",
        equation="elastic length = l0 + offset_length + offset",
        shows="tension residual grows with elongation, less so the longer the cable",
        confounded_with=("cable_stiffness",),
        separating_experiment="slow tension ramps at the shortest and the longest cable",
        reference="thesis (3-7): the stiffness falls with the elastic length",
    ),
)
