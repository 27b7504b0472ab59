"""A cable that is stiffer or softer than its law says, by the same factor everywhere."""

import numpy as np

from cspm_msgs_py.testbed import ExponentialStiffness, Testbed
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
    law, scale = testbed.cables[element].stiffness, values["scale"]
    if law is None:
        return testbed
    changes = {"youngs_modulus": scale * law.youngs_modulus}
    if isinstance(law, ExponentialStiffness):
        changes["a"] = scale * law.a
    return altered_cable(testbed, element, stiffness={**law.model_dump(), **changes})


def _columns(signals: Array) -> Array:
    # The law depends on scale and elongation by their product alone.
    slope = signals[:, CableSignal.STIFFNESS] * signals[:, CableSignal.ELONGATION]
    return np.asarray(slope[:, None, None])


EFFECT = Effect(
    id="cable_stiffness",
    block=Block.CABLE,
    parameters=(
        EffectParameter(
            "scale",
            "1",
            0.1,
            10.0,
            absent=1.0,
            meaning="multiplies; 1 is the law of the file",
            usual=0.05,
        ),
    ),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.TENSION, _columns)),
    description=Description(
        noun="stiffness",
        equation="dt/dε = scale·k(l, t), cap included",
        shows="tension residual grows with elongation, the same in motion either way",
        confounded_with=(
            "tension_gain",
            "cable_sag",
            "cable_length_offset",
            "cable_exit_offset",
            "cable_creep",
            "encoder_scale",
            "frame_flexibility",
        ),
        separating_experiment=(
            "slow tension ramps at two lengths, with a known mass hung on the bar"
        ),
        reference="thesis (3-7), (3-10)",
    ),
)
