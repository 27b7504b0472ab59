"""A winch frame that gives way to the cables, and rings.

All exits move together, in world axes, against the frame as it is measured. The frame's own inertia
against the motion of its base is left out.
"""

from collections.abc import Sequence
from math import pi

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
from cspm_sim.effects.linear_response import linear_response
from cspm_sim.effects.signals import FrameSignal
from cspm_sim.kernels.affected_cables import FRAME_FORCE, FRAME_SHIFT, FRAME_SHIFT_RATE


def _shift(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    for axis in range(3):
        signals[FRAME_SHIFT + axis] += states[axis]
        signals[FRAME_SHIFT_RATE + axis] += states[3 + axis]


def _ring(parameters: Array, signals: Array, states: Array, rates: Array) -> None:
    omega = 2.0 * pi * parameters[0]
    for axis in range(3):
        bent = parameters[2] * signals[FRAME_FORCE + axis]
        rates[axis] = states[3 + axis]
        rates[3 + axis] = (
            omega * omega * (bent - states[axis]) - 2.0 * parameters[1] * omega * states[3 + axis]
        )


def _rest(parameters: Array, signals: Array) -> Sequence[float]:
    bent = [parameters[2] * signals[FRAME_FORCE + axis] for axis in range(3)]
    return (*bent, 0.0, 0.0, 0.0)


def _columns(signals: Array, frequency: float, damping: float) -> Array:
    """Return what a frame adds that was at rest under the first sample's force."""
    omega = 2.0 * pi * frequency
    time = signals[:, FrameSignal.TIME]
    force = signals[:, FrameSignal.FORCE : FrameSignal.FORCE + 3]
    denominator = (1.0, 2.0 * damping * omega, omega**2)
    shift = linear_response((omega**2,), denominator, time, force - force[0])
    direction = signals[:, FrameSignal.DIRECTION : FrameSignal.DIRECTION + 3]
    shorter = np.sum(direction * shift, axis=1)
    return np.asarray((-signals[:, FrameSignal.STIFFNESS] * shorter)[:, None, None])


EFFECT = Effect(
    id="frame_flexibility",
    block=Block.FRAME,
    parameters=(
        EffectParameter("frequency", "Hz", 0.1, 100.0, absent=None),
        EffectParameter("damping", "1", 0.0, 1.0, absent=None, meaning="share of critical"),
        EffectParameter("compliance", "m/N", 0.0, 1e-2),
    ),
    physics=Physics(
        kernels={Hook.FRAME: _shift, Hook.LOADED_FRAME: _ring},
        states=6,
        rest=_rest,
    ),
    signature=Signature(
        regression=Regression(Channel.TENSION, _columns),
        nonlinear={"frequency": (1.0, 2.0, 4.0, 8.0, 16.0, 32.0), "damping": (0.02, 0.1, 0.5)},
    ),
    description=Description(
        noun="flexibility",
        equation=(
            "shift d of all exits: d̈ + 2·damping·ω·ḋ + ω²·d = ω²·compliance·(force of all"
            " cables), ω = 2π·frequency"
        ),
        shows=(
            "cable length residuals of all cables at once, with the total force and with one line"
        ),
        confounded_with=("frame_pose_offset", "cable_stiffness", "payload_swing"),
        separating_experiment=(
            "measure the frame's pose at the exits while the bar's load is stepped"
        ),
        reference=(
            "one mode of a structure, Craig, Kurdila, Fundamentals of Structural Dynamics, 2006"
        ),
    ),
)
