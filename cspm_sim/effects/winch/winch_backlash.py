"""Play between a winch's motor and its drum.

The drum has neither inertia nor noticeable friction: a taut cable draws it against the flank on
which the cable pulls, so that the play shows only where the cable goes slack. A slack cable leaves
it where it is until the motor's other flank takes it along.
"""

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
from cspm_sim.kernels.affected_cables import (
    CABLE_STEP,
    MOTOR_SPEED,
    SPAN_LENGTH,
    TURN_ADDED,
    UNSTRETCHED,
)
from cspm_sim.kernels.memory import played


def _kernel(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    # The drum's lead over the motor, from 0 on the loaded flank to `width`. As dry friction, it
    # takes the rate that would bring it to a flank within one step where it cannot go on.
    towards_load = -states[0] / signals[CABLE_STEP]
    towards_other = (parameters[0] - states[0]) / signals[CABLE_STEP]
    rate = -signals[MOTOR_SPEED]
    if signals[SPAN_LENGTH] > signals[UNSTRETCHED] or rate < towards_load:
        rate = towards_load
    elif rate > towards_other:
        rate = towards_other
    rates[0] = rate
    signals[TURN_ADDED] += rate


def _columns(signals: Array, width: float) -> Array:
    """Return what one unit of width adds where it is near `width`."""
    angle, taut = signals[:, CableSignal.ANGLE], signals[:, CableSignal.TENSION] > 0.0
    lead = np.zeros(len(angle))
    played(np.diff(angle, prepend=angle[0]), taut, width, lead)
    wound = signals[:, CableSignal.WOUND] * signals[:, CableSignal.RADIUS] * lead / width
    return np.asarray((signals[:, CableSignal.STIFFNESS] * wound)[:, None, None])


EFFECT = Effect(
    id="winch_backlash",
    block=Block.WINCH,
    parameters=(EffectParameter("width", "rad", 0.0, 0.5),),
    physics=Physics(
        kernels={Hook.CABLE: _kernel},
        states=1,
    ),
    signature=Signature(
        regression=Regression(Channel.TENSION, _columns),
        nonlinear={"width": (0.002, 0.005, 0.01, 0.02, 0.05, 0.1)},
        coefficients=lambda values: (values["width"],),
        from_coefficients=lambda weights, _: {"width": float(weights[0])},
    ),
    description=Description(
        noun="backlash",
        equation=(
            "drum angle·gear ratio = q + lead, 0 ≤ lead ≤ width; lead → 0 while the cable is taut,"
            " otherwise the drum rests until a flank moves it"
        ),
        shows=(
            "after slack the motor turns by up to width before the cable follows; nothing while"
            " taut"
        ),
        confounded_with=("cable_hysteresis",),
        separating_experiment="reverse a winch with its cable slack, then draw it taut slowly",
        reference="Nordin, Gutman, Automatica 38(10), 2002: backlash as play of a massless load",
    ),
)
