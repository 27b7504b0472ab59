"""A motion capture whose clock runs fast, so that its stamps stretch.

Stamps lie on the run's grid, so it is the readings that grow older than their stamps. A clock that
runs slow would need readings of what has not happened yet.
"""

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
from cspm_sim.effects.signals import PoseSignal


def _lateness(time: float, parameters: Array) -> float:
    return float(time * parameters[0] / (1.0 + parameters[0]))


def _columns(signals: Array) -> Array:
    rate = signals[:, PoseSignal.RATE : PoseSignal.RATE + 6]
    return np.asarray(-rate * signals[:, PoseSignal.TIME, None])[:, :, None]


EFFECT = Effect(
    id="clock_skew",
    block=Block.SENSOR,
    parameters=(EffectParameter("skew", "1", -0.01, 0.01, meaning="of the stamps, less one"),),
    elements=Elements.BODIES,
    physics=Physics(sense=Sense(("/{}/pose", "/{}/twist"), lateness=_lateness, one_system=True)),
    signature=Signature(
        regression=Regression(Channel.READING, _columns),
        # What two free clocks do.
        negligible={"skew": (-2e-5, 2e-5)},
    ),
    description=Description(
        noun="a clock of another rate",
        equation="pose and twist stamped τ = those at τ/(1 + skew), τ from the run's start",
        shows="pose lags behind the winches' motion, the more the longer the recording lasts",
        confounded_with=("pose_delay",),
        separating_experiment="the same motion at the beginning and the end of a long recording",
        reference="drift of quartz clocks, Mills, IEEE Trans. Comm. 39(10), 1991",
    ),
)
