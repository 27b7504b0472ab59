"""A drum of another radius than the test-bed file says."""

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
from cspm_sim.effects.signals import CableSignal, WinchSignal


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    radius = testbed.cables[element].drum_radius + values["radius"]
    return altered_cable(testbed, element, drum_radius=radius)


def _torque(signals: Array) -> Array:
    return np.asarray(
        (signals[:, WinchSignal.TENSION] / signals[:, WinchSignal.GEAR])[:, None, None]
    )


def _tension(signals: Array) -> Array:
    turned = signals[:, CableSignal.ANGLE] - signals[0, CableSignal.ANGLE]
    pulled = signals[:, CableSignal.STIFFNESS] * turned
    damped = signals[:, CableSignal.DAMPING] * signals[:, CableSignal.SPEED]
    wound = signals[:, CableSignal.WOUND] / signals[:, CableSignal.GEAR]
    return np.asarray((wound * (pulled + damped))[:, None, None])


EFFECT = Effect(
    id="winch_drum_radius",
    block=Block.WINCH,
    parameters=(EffectParameter("radius", "m", -0.1, 0.1, meaning="added to drum_radius"),),
    physics=Physics(alter=_alter),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _torque),
        partners=(Regression(Channel.TENSION, _tension),),
    ),
    description=Description(
        noun="drum radius",
        equation="winding radius = drum_radius + radius, in torque and cable alike",
        shows="torque residual in proportion to tension and cable length residual to motor angle",
        confounded_with=(
            "winch_torque_gain",
            "tension_gain",
            "winch_torque_offset",
            "encoder_scale",
        ),
        separating_experiment="wind several metres at constant tension, then hold known weights",
        reference="thesis (2-16), (2-21)",
    ),
)
