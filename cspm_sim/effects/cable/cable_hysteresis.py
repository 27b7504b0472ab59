"""Sliding between a cable's strands: a force of elongation and its reversals, not of its rate."""

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
from cspm_sim.kernels.affected_cables import ELONGATION_RATE, FORCE_ADDED
from cspm_sim.kernels.memory import relaxed


def _force(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    signals[FORCE_ADDED] += parameters[0] * states[0]


def _slide(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    rate = signals[ELONGATION_RATE]
    rates[0] = (rate - abs(rate) * states[0]) / parameters[1]


def _columns(signals: Array, displacement: float) -> Array:
    stretched = np.diff(
        signals[:, CableSignal.ELONGATION], prepend=signals[0, CableSignal.ELONGATION]
    )
    share = np.zeros((len(signals), 1))
    kept = np.exp(-np.abs(stretched) / displacement)
    relaxed(np.sign(stretched)[:, None], kept[:, None], share)
    return share[:, :, None]


EFFECT = Effect(
    id="cable_hysteresis",
    block=Block.CABLE,
    parameters=(
        EffectParameter("force", "N", 0.0, 50.0),
        EffectParameter("displacement", "m", 1e-5, 0.1, absent=None),
    ),
    physics=Physics(
        kernels={Hook.CABLE: _force, Hook.LOADED_CABLE: _slide},
        states=1,
    ),
    signature=Signature(
        regression=Regression(Channel.TENSION, _columns),
        nonlinear={"displacement": (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2)},
        saturates=True,
    ),
    description=Description(
        noun="hysteresis",
        equation="t = law + force·z, dz/dt = (ε̇ − |ε̇|·z)/displacement",
        shows="tension residual loops with an area per cycle that does not depend on the frequency",
        confounded_with=("cable_axial_damping", "cable_creep", "winch_backlash"),
        separating_experiment="one amplitude at three frequencies a decade apart, then another one",
        reference="Dahl, AIAA Journal 14(12), 1976, with exponent 1",
    ),
)
