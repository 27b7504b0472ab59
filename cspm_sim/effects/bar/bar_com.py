"""A centre of mass beside the one that the test-bed file says."""

import numpy as np

from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.alteration import altered_bar
from cspm_sim.effects.bar_motion import bar_motion, carried
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
from cspm_sim.effects.signals import BarSignal


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    if testbed.bar is None:
        return testbed
    com = [old + values[axis] for old, axis in zip(testbed.bar.com, "xyz", strict=True)]
    return altered_bar(testbed, com=com)


def _columns(signals: Array) -> Array:
    """Return the first order of the shift; it is far shorter than the bar."""
    motion, mass = bar_motion(signals), signals[:, BarSignal.MASS, None]
    columns = []
    for axis in range(3):
        shift = motion.rotation[:, :, axis]
        force = -mass * carried(motion.omega, motion.alpha, shift)
        moment = np.cross(shift, mass * motion.falling) + np.cross(motion.com, force)
        columns.append(np.hstack([force, moment]))
    return np.stack(columns, -1)


EFFECT = Effect(
    id="bar_com",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(axis, "m", -1.0, 1.0, meaning="added to com, in bar axes") for axis in "xyz"
    ),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="centre of mass",
        equation="the bar's centre of mass = com + (x, y, z) in bar_ned; inertia about it stays",
        shows="bar wrench residual is a moment, the weight times an arm that turns with the bar",
        confounded_with=(
            "bar_constant_wrench",
            "pose_offset",
            "bar_restoring",
            "cable_attachment_offset",
        ),
        separating_experiment="hold still at two pitches or rolls and at two tension levels",
        reference="thesis (2-11), (2-12)",
    ),
)
