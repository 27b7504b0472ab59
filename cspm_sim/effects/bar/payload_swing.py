"""A mass that swings on a rod below the bar frame's origin.

The rod turns freely about the origin of bar_ned; its states are two angles, about the world's x and
y, and their rates. Bar and mass are coupled exactly: the rod's force is the one with which both
accelerate as the rod allows.
"""

from collections.abc import Sequence
from math import cos, sin

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
from cspm_sim.effects.linear_response import linear_response
from cspm_sim.effects.signals import BarSignal
from cspm_sim.kernels.bar_effects import (
    FREE_ACCELERATION,
    MOBILITY,
    PENDANT_GRAVITY,
    VELOCITY,
    WRENCH,
)


def _kernel(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    mass, length, damping = parameters[0], parameters[1], parameters[2]
    sa, ca, sb, cb = sin(states[0]), cos(states[0]), sin(states[1]), cos(states[1])
    da, db = states[2], states[3]
    # From origin to mass, and its derivatives by the second angle and, over cb, by the first.
    dx, dy, dz = sb, -sa * cb, ca * cb
    ay, az = -ca, -sa
    bx, by, bz = cb, sa * sb, -ca * sb
    # Gravity and drag per mass.
    drag = damping / mass
    v = VELOCITY
    gx = -drag * (signals[v] + length * db * bx)
    gy = -drag * (signals[v + 1] + length * (da * cb * ay + db * by))
    gz = signals[PENDANT_GRAVITY] - drag * (signals[v + 2] + length * (da * cb * az + db * bz))
    f, m = FREE_ACCELERATION, MOBILITY
    mx = signals[m] * dx + signals[m + 1] * dy + signals[m + 2] * dz
    my = signals[m + 3] * dx + signals[m + 4] * dy + signals[m + 5] * dz
    mz = signals[m + 6] * dx + signals[m + 7] * dy + signals[m + 8] * dz
    falling = dx * (gx - signals[f]) + dy * (gy - signals[f + 1]) + dz * (gz - signals[f + 2])
    turning = da * cb * da * cb + db * db
    rod = (falling + length * turning) / (1.0 / mass + dx * mx + dy * my + dz * mz)
    hx = gx - signals[f] - rod * mx
    hy = gy - signals[f + 1] - rod * my
    hz = gz - signals[f + 2] - rod * mz
    rates[0] = da
    rates[1] = db
    rates[2] = ((ay * hy + az * hz) / length + 2.0 * da * db * sb) / cb
    rates[3] = (bx * hx + by * hy + bz * hz) / length - da * da * sb * cb
    signals[WRENCH] += rod * dx
    signals[WRENCH + 1] += rod * dy
    signals[WRENCH + 2] += rod * dz


def _columns(signals: Array, length: float, damping: float) -> Array:
    """Return what a mass of 1 kg adds, to first order in its angles, at rest at first.

    `damping` is that of a mass of 1 kg.
    """
    time = signals[:, BarSignal.TIME]
    velocity = signals[:, BarSignal.VELOCITY : BarSignal.VELOCITY + 3]
    acceleration = signals[:, BarSignal.ACCELERATION : BarSignal.ACCELERATION + 3]
    gravity = signals[0, BarSignal.GRAVITY]
    wrench = np.zeros((len(time), 6, 1))
    driven = -acceleration[:, :2] - damping * velocity[:, :2]
    swung = linear_response((1.0,), (1.0, damping, gravity / length), time, driven)
    wrench[:, :2, 0] = gravity / length * swung
    wrench[:, 2, 0] = gravity - acceleration[:, 2] - damping * velocity[:, 2]
    return wrench


def _weights(values: Values) -> tuple[float]:
    return (values["mass"],)


def _values(weights: Sequence[float], nonlinear: Values) -> dict[str, float]:
    mass = float(weights[0])
    return {"mass": mass, "length": nonlinear["length"], "damping": mass * nonlinear["damping"]}


EFFECT = Effect(
    id="payload_swing",
    block=Block.BAR,
    parameters=(
        EffectParameter("mass", "kg", 0.0, 100.0),
        EffectParameter("length", "m", 0.02, 20.0, absent=None),
        EffectParameter(
            "damping", "N·s/m", 0.0, 100.0, absent=None, meaning="drag of still air on the mass"
        ),
    ),
    physics=Physics(
        kernels={Hook.PENDANT: _kernel},
        states=4,
    ),
    signature=Signature(
        regression=Regression(Channel.WRENCH, _columns),
        nonlinear={"length": (0.1, 0.2, 0.4, 0.8, 1.6), "damping": (0.0, 0.3)},
        coefficients=_weights,
        from_coefficients=_values,
    ),
    description=Description(
        noun="a swinging payload",
        equation=(
            "point mass on a massless rod of that length, hinged at the bar frame's origin, with"
            " the drag −damping·(its velocity)"
        ),
        shows="bar force residual with a line at sqrt(g/length), and the weight of the mass",
        confounded_with=("bar_mass", "bar_inertia", "frame_flexibility"),
        separating_experiment=(
            "stop abruptly and watch the decay; repeat with the payload taken off"
        ),
        reference="spherical pendulum, Goldstein, Poole, Safko, Classical Mechanics, chapter 2",
    ),
)
