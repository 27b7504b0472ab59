"""A bar that is heavier or lighter than the test-bed file says, about the same centre of mass."""

import numpy as np

from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.alteration import altered_bar
from cspm_sim.effects.bar_motion import bar_motion
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


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    return (
        testbed
        if testbed.bar is None
        else altered_bar(testbed, mass=testbed.bar.mass + values["mass"])
    )


def _columns(signals: Array) -> Array:
    motion = bar_motion(signals)
    return np.hstack([motion.falling, np.cross(motion.com, motion.falling)])[:, :, None]


EFFECT = Effect(
    id="bar_mass",
    block=Block.BAR,
    parameters=(EffectParameter("mass", "kg", -100.0, 100.0, meaning="added to the bar's mass"),),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="mass",
        equation="the bar's mass = that of the file + mass; its centre and inertia about it stay",
        shows=(
            "bar wrench residual is in proportion to gravity less acceleration of the centre of"
            " mass"
        ),
        confounded_with=("bar_constant_wrench", "payload_swing", "tension_gain", "cable_sag"),
        separating_experiment="weigh the bar, or shake it up and down above the cables' modes",
        reference="thesis (2-10) to (2-12)",
    ),
)
