"""A winch whose rotating parts are heavier or lighter than the test-bed file says."""

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
from cspm_sim.effects.signals import WinchSignal


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    inertia = testbed.cables[element].rotor_inertia + values["inertia"]
    return altered_cable(testbed, element, rotor_inertia=inertia)


def _columns(signals: Array) -> Array:
    return np.asarray(signals[:, WinchSignal.ACCELERATION, None, None])


EFFECT = Effect(
    id="winch_inertia",
    block=Block.WINCH,
    parameters=(EffectParameter("inertia", "kg·m²", -1.0, 1.0, meaning="added to rotor_inertia"),),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.SHAFT, _columns)),
    description=Description(
        noun="inertia",
        equation="all that turns at the motor shaft has rotor_inertia + inertia",
        shows="winch torque residual is in proportion to the motor's acceleration",
        confounded_with=("winch_torque_lag",),
        separating_experiment=(
            "sweep the frequency with slack cable: lag grows with it, inertia not"
        ),
        reference="thesis (2-20)",
    ),
)
