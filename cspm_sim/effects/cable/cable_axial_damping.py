"""A cable that is more or less damped along itself than its law says."""

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
    law = testbed.cables[element].damping
    if law is None:
        return testbed
    factor = values["scale"] * law.factor
    return altered_cable(testbed, element, damping={**law.model_dump(), "factor": factor})


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, CableSignal.DAMPER, None, None])


EFFECT = Effect(
    id="cable_axial_damping",
    block=Block.CABLE,
    parameters=(
        EffectParameter(
            "scale", "1", 0.0, 100.0, absent=1.0, meaning="multiplies; 1 is the law of the file"
        ),
    ),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.TENSION, _columns)),
    description=Description(
        noun="damping along it",
        equation="damper of the cable = scale·factor·(constant − slope·l)",
        shows=(
            "tension residual is in proportion to the rate of elongation, loops grow with frequency"
        ),
        confounded_with=(
            "winch_viscous_friction",
            "cable_hysteresis",
            "pose_delay",
            "tension_delay",
            "bar_linear_damping",
        ),
        separating_experiment="pluck the bar with winches locked, at three frequencies or more",
        reference="thesis (3-13) and its factor of section 4-2",
    ),
)
