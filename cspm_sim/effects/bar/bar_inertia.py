"""A bar that is harder or easier to turn than the test-bed file says."""

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

_MOMENTS = ("ixx", "iyy", "izz")
# Of the excess, so that rounding leaves none.
_BEYOND = 1e-6


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    if testbed.bar is None:
        return testbed
    inertia = testbed.bar.inertia.model_dump()
    changed = {name: inertia[name] + values[name] for name in _MOMENTS}
    return altered_bar(testbed, inertia={**inertia, **changed})


def _nearest(testbed: Testbed, values: Values, errors: Values) -> Values:
    """Return values of which no moment is greater than the other two together.

    The nearest in units of their errors; the products of inertia are taken for none.
    """
    if testbed.bar is None:
        return values
    inertia = testbed.bar.inertia.model_dump()
    found = np.array([values[name] for name in _MOMENTS])
    moments = found + [inertia[name] for name in _MOMENTS]
    across = np.where(np.arange(3) == np.argmax(moments), 1.0, -1.0)
    excess = float(across @ moments)
    if excess <= 0.0:
        return values
    turned = np.array([errors[name] ** 2 for name in _MOMENTS]) * across
    moved = found - (1.0 + _BEYOND) * excess * turned / float(across @ turned)
    return dict(zip(_MOMENTS, moved.tolist(), strict=True))


def _columns(signals: Array) -> Array:
    motion = bar_motion(signals)
    to_bar = motion.rotation.transpose(0, 2, 1)
    omega = np.einsum("kij,kj->ki", to_bar, motion.omega)
    alpha = np.einsum("kij,kj->ki", to_bar, motion.alpha)
    columns = []
    for axis in np.eye(3):
        moment = -(axis * alpha + np.cross(omega, axis * omega))
        world = np.einsum("kij,kj->ki", motion.rotation, moment)
        columns.append(np.hstack([np.zeros(world.shape), world]))
    return np.stack(columns, -1)


EFFECT = Effect(
    id="bar_inertia",
    block=Block.BAR,
    parameters=tuple(
        EffectParameter(name, "kg·m²", -10.0, 10.0, meaning="added to the same entry of inertia")
        for name in _MOMENTS
    ),
    physics=Physics(
        alter=_alter,
        nearest=_nearest,
    ),
    signature=Signature(regression=Regression(Channel.WRENCH, _columns)),
    description=Description(
        noun="inertia",
        equation=(
            "the bar's inertia about its centre of mass, bar axes = that of the file + diagonal"
        ),
        shows="bar wrench residual is a moment in proportion to angular acceleration",
        confounded_with=("payload_swing",),
        separating_experiment=(
            "turn the bar to and fro at two frequencies; held still it shows nothing"
        ),
        reference="thesis (2-12)",
    ),
)
