"""A cable with weight: it hangs through, and half of its weight pulls at either end.

Its tension is that at the exit, where load cell and winch are: that of the law, which the middle
carries, and half of the weight along the cable. At the bar it is less by all of that weight.
"""

from collections.abc import Sequence
from math import sqrt

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Hook,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import CableSignal, EndSignal
from cspm_sim.kernels.affected_cables import (
    CABLE_GRAVITY,
    DOWNWARD,
    FORCE_ADDED,
    HORIZONTAL,
    SAG,
    SPAN_LENGTH,
)
from cspm_sim.kernels.bar_effects import END_DIRECTION, END_FORCE, END_GRAVITY, END_LENGTH

_LEAST = 1e-3  # [N]; where the tension is less the first order says nothing


def _hang(parameters: Array, signals: Array) -> None:
    weight = parameters[0] * signals[CABLE_GRAVITY] * signals[HORIZONTAL]
    signals[SAG] += weight * weight * signals[SPAN_LENGTH] ** 3 / 24.0
    half = 0.5 * parameters[0] * signals[CABLE_GRAVITY] * signals[SPAN_LENGTH]
    signals[FORCE_ADDED] += half * signals[DOWNWARD]


def _pull(parameters: Array, signals: Array) -> None:
    half = 0.5 * parameters[0] * signals[END_GRAVITY] * signals[END_LENGTH]
    for axis in range(3):
        along = signals[END_DIRECTION + 2] * signals[END_DIRECTION + axis]
        signals[END_FORCE + axis] += half * along
    signals[END_FORCE + 2] += half


def _tension(signals: Array) -> Array:
    across = signals[:, CableSignal.GRAVITY] * signals[:, CableSignal.HORIZONTAL]
    elastic = signals[:, CableSignal.TENSION] - signals[:, CableSignal.DAMPER]
    tension = np.maximum(elastic, _LEAST)
    longer = across**2 * signals[:, CableSignal.LENGTH] ** 3 / (24.0 * tension**2)
    column = signals[:, CableSignal.STIFFNESS] * longer
    half = 0.5 * signals[:, CableSignal.GRAVITY] * signals[:, CableSignal.LENGTH]
    return np.stack([column, half * signals[:, CableSignal.DOWNWARD]], -1)[:, None]


def _wrench(signals: Array) -> Array:
    half = 0.5 * signals[:, EndSignal.GRAVITY] * signals[:, EndSignal.LENGTH]
    direction = signals[:, EndSignal.DIRECTION : EndSignal.DIRECTION + 3]
    force = half[:, None] * (np.array([0.0, 0.0, 1.0]) + direction[:, 2:] * direction)
    moment = np.cross(signals[:, EndSignal.ARM : EndSignal.ARM + 3], force)
    column = np.hstack([force, moment])
    return np.stack([np.zeros(column.shape), column], -1)


def _weights(values: Values) -> tuple[float, float]:
    return values["linear_density"] ** 2, values["linear_density"]


def _values(weights: Sequence[float], _: Values) -> dict[str, float]:
    """Return the density of the weight's share, which swinging does not change as it does sag.

    Only a level cable that ends at a wall shows no weight.
    """
    hanging, weight = weights
    return {"linear_density": max(0.0, weight) if weight else sqrt(max(0.0, hanging))}


EFFECT = Effect(
    id="cable_sag",
    block=Block.CABLE,
    parameters=(EffectParameter("linear_density", "kg/m", 0.0, 1.0),),
    physics=Physics(kernels={Hook.CABLE: _hang, Hook.ATTACHMENT: _pull}),
    signature=Signature(
        regression=Regression(Channel.TENSION, _tension),
        partners=(Regression(Channel.WRENCH, _wrench),),
        coefficients=_weights,
        from_coefficients=_values,
    ),
    description=Description(
        noun="sag under its own weight",
        equation=(
            "t = law(ε + (w·l)²·l/(24·t²)) + W·d, t in the law without damping,"
            " w = linear_density·g·(horizontal share of the direction), W = linear_density·g·l/2,"
            " d the direction's share downwards;"
            " force on the bar W downwards, and W·d off what t pulls"
        ),
        shows="tension residual as 1/t², largest in long, horizontal, lightly loaded cables",
        confounded_with=("cable_stiffness", "bar_mass"),
        separating_experiment=(
            "tension ramps down to the least, in a horizontal and a vertical cable"
        ),
        reference=(
            "Irvine, Cable Structures, 1981: the parabola, for a sag below an eighth of the span"
        ),
    ),
)
