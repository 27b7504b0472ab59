"""A cable with weight: it hangs through, and it pulls the bar down with half of its weight."""

from collections.abc import Sequence
from math import sqrt

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Effect,
    EffectParameter,
    Hook,
    Regression,
    Values,
)
from cspm_sim.effects.signals import CableSignal, EndSignal
from cspm_sim.kernels.affected_cables import CABLE_GRAVITY, HORIZONTAL, SAG, SPAN_LENGTH
from cspm_sim.kernels.bar_effects import END_FORCE, END_GRAVITY, END_LENGTH

_LEAST = 1e-3  # [N]; where the tension is less the first order says nothing


def _hang(parameters: Array, signals: Array) -> None:
    weight = parameters[0] * signals[CABLE_GRAVITY] * signals[HORIZONTAL]
    signals[SAG] += weight * weight * signals[SPAN_LENGTH] ** 3 / 24.0


def _pull(parameters: Array, signals: Array) -> None:
    signals[END_FORCE + 2] += 0.5 * parameters[0] * signals[END_GRAVITY] * signals[END_LENGTH]


def _tension(signals: Array) -> Array:
    across = signals[:, CableSignal.GRAVITY] * signals[:, CableSignal.HORIZONTAL]
    elastic = signals[:, CableSignal.TENSION] - signals[:, CableSignal.DAMPER]
    tension = np.maximum(elastic, _LEAST)
    longer = across**2 * signals[:, CableSignal.LENGTH] ** 3 / (24.0 * tension**2)
    column = signals[:, CableSignal.STIFFNESS] * longer
    return np.stack([column, np.zeros(len(column))], -1)[:, None]


def _wrench(signals: Array) -> Array:
    half = 0.5 * signals[:, EndSignal.GRAVITY] * signals[:, EndSignal.LENGTH]
    force = half[:, None] * np.array([0.0, 0.0, 1.0])
    moment = np.cross(signals[:, EndSignal.ARM : EndSignal.ARM + 3], force)
    column = np.hstack([force, moment])
    return np.stack([np.zeros(column.shape), column], -1)


def _weights(values: Values) -> tuple[float, float]:
    return values["linear_density"] ** 2, values["linear_density"]


def _values(weights: Sequence[float], _: Values) -> dict[str, float]:
    return {"linear_density": sqrt(max(0.0, float(weights[0])))}


EFFECT = Effect(
    id="cable_sag",
    noun="sag under its own weight",
    block=Block.CABLE,
    parameters=(EffectParameter("linear_density", "kg/m", 0.0, 1.0),),
    kernels={Hook.CABLE: _hang, Hook.ATTACHMENT: _pull},
    regression=Regression(Channel.TENSION, _tension),
    partners=(Regression(Channel.WRENCH, _wrench),),
    coefficients=_weights,
    from_coefficients=_values,
    equation=(
        "t = law(ε + (w·l)²·l/(24·t²)), t without damping, w = linear_density·g·(horizontal"
        " share of the direction);"
        " force on the bar linear_density·g·l/2 downwards"
    ),
    shows="tension residual as 1/t², largest in long, horizontal, lightly loaded cables",
    twins=("cable_stiffness", "bar_mass"),
    separating_experiment="tension ramps down to the least, in a horizontal and a vertical cable",
    reference="Irvine, Cable Structures, 1981: the parabola, for a sag below an eighth of the span",
)
