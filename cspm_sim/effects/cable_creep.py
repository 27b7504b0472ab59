"""A cable that goes on stretching under load, and recovers."""

from collections.abc import Sequence

import numpy as np

from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Effect,
    EffectParameter,
    Hook,
    Regression,
)
from cspm_sim.effects.signals import CableSignal
from cspm_sim.kernels.affected_cables import (
    ELASTIC_TENSION,
    ELONGATION_ADDED,
    MOTOR_SPEED,
    RADIUS_ADDED,
    SPAN_LENGTH,
    TURN_ADDED,
    WOUND_RADIUS,
)
from cspm_sim.kernels.memory import relaxed


def _stretch(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    signals[ELONGATION_ADDED] -= states[0]


def _creep(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    # Cable that is wound takes its creep with it, and brings it when it is let out.
    radius = signals[WOUND_RADIUS] + signals[RADIUS_ADDED]
    wound = radius * (signals[MOTOR_SPEED] + signals[TURN_ADDED]) / signals[SPAN_LENGTH]
    goal = parameters[0] * signals[ELASTIC_TENSION]
    rates[0] = (goal - states[0]) / parameters[1] - wound * states[0]


def _rest(parameters: Array, signals: Array) -> Sequence[float]:
    return (parameters[0] * signals[ELASTIC_TENSION],)


def _columns(signals: Array, time_constant: float) -> Array:
    """Return what creep adds that was at rest under the first sample's tension.

    Per unstretched length creep follows the tension per unstretched length, whatever is wound.
    """
    time = signals[:, CableSignal.TIME]
    lengths = signals[:, CableSignal.WOUND] * signals[:, CableSignal.LENGTH]
    pull = (signals[:, CableSignal.TENSION] - signals[:, CableSignal.DAMPER]) / lengths
    means = pull[:, None].copy()
    means[1:, 0] = 0.5 * (pull[1:] + pull[:-1])
    kept = np.exp(-np.diff(time, prepend=time[0]) / time_constant)[:, None]
    crept = means.copy()
    relaxed(means, kept, crept)
    grown = lengths * (crept[:, 0] - crept[0, 0])
    return np.asarray((-signals[:, CableSignal.STIFFNESS] * grown)[:, None, None])


EFFECT = Effect(
    id="cable_creep",
    block=Block.CABLE,
    parameters=(
        EffectParameter("compliance", "m/N", 0.0, 0.1, meaning="of the whole cable"),
        EffectParameter("time_constant", "s", 0.01, 1e5, absent=None),
    ),
    kernels={Hook.CABLE: _stretch, Hook.LOADED_CABLE: _creep},
    states=1,
    rest=_rest,
    regression=Regression(Channel.TENSION, _columns),
    nonlinear={"time_constant": (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)},
    equation="t = law(ε − e), ė = (compliance·t − e)/time_constant + e·l̇0/l0, t undamped",
    shows="tension at fixed length falls slowly after a load step, and recovers after unloading",
    twins=("cable_hysteresis", "cable_stiffness"),
    separating_experiment="hold for several time constants after a step of load up, then down",
    reference="Findley, Lai, Onaran, Creep and Relaxation, 1976: a Kelvin-Voigt element in series",
)
