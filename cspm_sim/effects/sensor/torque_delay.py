"""A drive whose reported torque is older, or newer, than the encoder's reading beside it."""

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
from cspm_sim.effects.signals import WinchSignal


def _lateness(time: float, parameters: Array) -> float:
    return float(parameters[0])


def _columns(signals: Array) -> Array:
    return np.asarray(-signals[:, WinchSignal.TORQUE_RATE, None, None])


def _of_drive(signals: Array) -> Array:
    """Return the change of commanded less reported torque."""
    return -_columns(signals)


EFFECT = Effect(
    id="torque_delay",
    block=Block.SENSOR,
    parameters=(EffectParameter("delay", "s", -0.1, 1.0, meaning="below 0: too new"),),
    elements=Elements.CABLES,
    physics=Physics(
        sense=Sense(("/winches/state",), lateness=_lateness, one_system=True, quantity="torque")
    ),
    signature=Signature(
        regression=Regression(Channel.SHAFT, _columns),
        partners=(Regression(Channel.DRIVE, _of_drive),),
        # A drive reports what it held for an unknown part of a period, here at 1 kHz.
        negligible={"delay": (-1e-3, 1e-3)},
    ),
    description=Description(
        noun="a delay of its reported torque",
        equation="torque stamped τ = that at τ − delay, beside an angle at τ",
        shows=(
            "torque residual in proportion to the rate of the torque: a false inertia and gain"
            " where the motion is quick, a false viscous friction where it has one frequency"
        ),
        confounded_with=("winch_viscous_friction", "winch_torque_lag"),
        separating_experiment="sweep the frequency: a delay's part grows with it, friction's stays",
        reference="drives that log a filtered current, and logs joined from two devices",
    ),
)
