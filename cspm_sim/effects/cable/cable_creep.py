"""A cable that goes on stretching under load, and recovers."""

from collections.abc import Sequence

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
)
from cspm_sim.effects.signals import CableSignal
from cspm_sim.kernels.affected_cables import ELASTIC_TENSION, ELONGATION_ADDED, UNSTRETCHED
from cspm_sim.kernels.memory import relaxed

# A single sample's noise would be forgotten within a time constant only, and look like creep.
_BEGINNING_S = 0.3


def _stretch(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    signals[ELONGATION_ADDED] -= states[0] * signals[UNSTRETCHED] * states[1]


def _creep(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    # Of the cable that hung at the start; what is wound takes its share with it, and a shorter
    # cable creeps less.
    rates[0] = (parameters[0] * signals[ELASTIC_TENSION] - states[0]) / parameters[1]
    rates[1] = 0.0


def _rest(parameters: Array, signals: Array) -> Sequence[float]:
    stretched = parameters[0] * signals[ELASTIC_TENSION] - parameters[2]
    return stretched, 1.0 / signals[UNSTRETCHED]


def _columns(signals: Array, time_constant: float) -> Array:
    """Return what creep adds that was at rest under the tension of the beginning, and was not."""
    time = signals[:, CableSignal.TIME]
    lengths = signals[:, CableSignal.WOUND] * signals[:, CableSignal.LENGTH]
    tension = signals[:, CableSignal.TENSION] - signals[:, CableSignal.DAMPER]
    means = tension[:, None].copy()
    means[1:, 0] = 0.5 * (tension[1:] + tension[:-1])
    kept = np.exp(-np.diff(time, prepend=time[0]) / time_constant)[:, None]
    crept = means.copy()
    crept[0] = np.median(tension[time - time[0] <= _BEGINNING_S])
    relaxed(means, kept, crept)
    missing = -np.exp(-(time - time[0]) / time_constant)
    grown = np.stack([crept[:, 0] - crept[0, 0], missing], axis=1) * (lengths / lengths[0])[:, None]
    return np.asarray((-signals[:, CableSignal.STIFFNESS, None] * grown)[:, None])


EFFECT = Effect(
    id="cable_creep",
    block=Block.CABLE,
    parameters=(
        EffectParameter("compliance", "m/N", 0.0, 0.1, meaning="of the cable at the start"),
        EffectParameter("time_constant", "s", 0.01, 1e5, absent=None),
        EffectParameter(
            "initial_deficit",
            "m",
            -1.0,
            1.0,
            meaning="of creep at the start against that at rest under its load",
            default=0.0,
        ),
    ),
    physics=Physics(
        kernels={Hook.CABLE: _stretch, Hook.LOADED_CABLE: _creep},
        states=2,
        rest=_rest,
    ),
    signature=Signature(
        regression=Regression(Channel.TENSION, _columns),
        nonlinear={"time_constant": (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)},
        spectrum="time_constant",
    ),
    description=Description(
        noun="creep",
        equation=(
            "t = law(ε − e·l0/l0(0)), time_constant·de/dt = compliance·t − e, t without damping"
        ),
        shows=(
            "tension at fixed length falls slowly after a load step, and recovers after unloading"
        ),
        confounded_with=("cable_hysteresis", "cable_stiffness", "tension_drift"),
        separating_experiment="hold for several time constants after a step of load up, then down",
        reference=(
            "Findley, Lai, Onaran, Creep and Relaxation, 1976: a Kelvin-Voigt element in series"
        ),
    ),
)
