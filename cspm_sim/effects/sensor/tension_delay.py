"""Load cells whose readings are older than their stamps say, as behind an amplifier's filter."""

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
from cspm_sim.effects.signals import ReadingSignal


def _lateness(time: float, parameters: Array) -> float:
    return float(parameters[0])


def _columns(signals: Array) -> Array:
    return np.asarray(-signals[:, ReadingSignal.RATE, None, None])


EFFECT = Effect(
    id="tension_delay",
    block=Block.SENSOR,
    parameters=(EffectParameter("delay", "s", -0.01, 1.0, meaning="below 0: too new"),),
    elements=Elements.CELLS,
    physics=Physics(sense=Sense(("/cables/tension",), lateness=_lateness, one_system=True)),
    signature=Signature(
        regression=Regression(Channel.READING, _columns),
        # As well as clocks are set to each other; no filter makes a reading too new, so that only
        # the stamps of a log do, by up to a sample at 1 kHz.
        negligible={"delay": (-1e-3, 2.5e-4)},
    ),
    description=Description(
        noun="a delay",
        equation="tensions stamped τ = those at τ − delay",
        shows=(
            "torque residual of each winch in proportion to the rate of its tension, as of viscous"
            " friction where tension follows the angle; a damper of −stiffness·delay in all cables"
        ),
        confounded_with=(
            "winch_viscous_friction",
            "cable_axial_damping",
            "pose_delay",
            "tension_lag",
        ),
        separating_experiment="sweep the frequency with the winch locked: friction is silent then",
        reference="group delay of a carrier-frequency amplifier's low-pass filter",
    ),
)
