"""A motion capture whose readings are older than their stamps say, or newer where clocks differ."""

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
    return float(parameters[0])


def _columns(signals: Array) -> Array:
    return np.asarray(-signals[:, PoseSignal.RATE : PoseSignal.RATE + 6, None])


EFFECT = Effect(
    id="pose_delay",
    block=Block.SENSOR,
    parameters=(EffectParameter("delay", "s", -0.01, 1.0, meaning="below 0: too new"),),
    elements=Elements.BODIES,
    physics=Physics(sense=Sense(("/{}/pose", "/{}/twist"), lateness=_lateness, one_system=True)),
    signature=Signature(
        regression=Regression(Channel.READING, _columns),
        # As well as clocks are set to each other.
        negligible={"delay": (-2.5e-4, 2.5e-4)},
    ),
    description=Description(
        noun="a delay",
        equation="pose and twist stamped τ = those at τ − delay",
        shows=(
            "tension residuals as of a damper stiffness·delay; pose lags behind the winches' motion"
        ),
        confounded_with=("cable_axial_damping", "winch_torque_lag", "clock_skew", "tension_delay"),
        separating_experiment=(
            "sweep the frequency: a phase in proportion to it, alike in all cables"
        ),
        reference="latency of optical motion capture; first order of the shift in time",
    ),
)
