"""Known effects, added to the measured channels of a recording as it is.

Written from the equations of the reference pages, not with the catalogue's regressors. The torque
that a drive reports is before its errors: torque at the shaft = gain·reported + offset + ripple.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from bench.concealed.machine import Machine

Array = NDArray[np.float64]
Signals = Mapping[str, Array]

# Slower than this share of the fastest, a shaft is at rest.
_MOVING = 0.05
# Speed and acceleration are those of a cubic over so long [s].
_SMOOTH_S = 0.12
_ORDERS = {1.0: 6, -1.0: 9}


class Motion(NamedTuple):
    """What a recording measured, SI, at the shaft.

    Attributes:
        angle, speed, acceleration: of the shaft.
        torque: as reported.
        tension: of the cable, empty where none is measured.
        moving: where the shaft moves.
    """

    angle: Array
    speed: Array
    acceleration: Array
    torque: Array
    tension: Array
    moving: NDArray[np.bool_]

    def rms(self, values: Array) -> float:
        """Return the RMS of values while the shaft moves."""
        return float(np.sqrt(np.nanmean(values[self.moving] ** 2)))


class Spike(NamedTuple):
    """A known effect of known size.

    Attributes:
        parameters: of the effect, true.
        parameter: the one that is judged.
        base: what it is without the effect.
        change: `change(signals)`: what the recording measures with it.
    """

    parameters: dict[str, float]
    parameter: str
    base: float
    change: Callable[[Signals], dict[str, Array]]


def motion_of(machine: Machine, signals: Signals) -> Motion:
    """Return the motion of a recording's shaft."""
    angle, rate = signals["angle"], machine.rate
    window = max(5, 2 * round(0.5 * _SMOOTH_S * rate) + 1)
    speed, acceleration = (
        savgol_filter(angle, window, 3, deriv=order, delta=1.0 / rate) for order in (1, 2)
    )
    moving = np.abs(speed) > _MOVING * np.abs(speed).max()
    tension = signals.get("tension", np.empty(0))
    return Motion(angle, speed, acceleration, signals["torque"], tension, moving)


def spike_of(machine: Machine, effect: str, size: float, signals: Signals, sign: float) -> Spike:
    """Return an effect of a size.

    Args:
        machine: that was recorded.
        effect: its id.
        size: of what it adds to the judged residual, in RMS of what is unexplained there.
        signals: of the first searched recording, which gives sizes.
        sign: 1 or −1, of what can have both; it gives orders and phases as well.
    """
    if not machine.inertia:
        return _LOCKED[effect](sign, size * machine.unexplained, signals, machine.rate)
    motion = motion_of(machine, signals)
    amount = size * machine.unexplained
    if effect in TORQUES:
        return _torque(machine, effect, amount * _signed(effect, sign), motion)
    return _SENSED[effect](machine, sign, amount, motion)


def _signed(effect: str, sign: float) -> float:
    return sign if effect in _BOTH_WAYS else 1.0


# By effect, the number that scales it, and the resisting torque of one unit at the shaft.
TORQUES: Mapping[str, tuple[str, Callable[[Machine, Motion], Array]]] = {
    "winch_coulomb_friction": ("torque", lambda _, m: np.sign(m.speed)),
    "winch_viscous_friction": ("coefficient", lambda _, m: m.speed),
    "winch_inertia": ("inertia", lambda _, m: m.acceleration),
    "winch_directional_friction": ("coefficient", lambda _, m: np.abs(m.speed)),
    "winch_torque_offset": ("torque", lambda _, m: -np.ones_like(m.angle)),
    "winch_unbalance": ("sine", lambda _, m: np.sin(m.angle)),
    "winch_load_friction": (
        "coefficient",
        lambda machine, m: np.abs(m.tension) * machine.radius * np.sign(m.speed),
    ),
}
_BOTH_WAYS = ("winch_torque_offset", "winch_directional_friction", "winch_unbalance")


def _torque(machine: Machine, effect: str, amount: float, motion: Motion) -> Spike:
    name, column = TORQUES[effect]
    value = amount / motion.rms(column(machine, motion))
    more = {"cosine": 0.0, "order": 1.0} if effect == "winch_unbalance" else {}

    def change(signals: Signals) -> dict[str, Array]:
        added = value * column(machine, motion_of(machine, signals))
        return {"torque": signals["torque"] + added}

    return Spike({name: value, **more}, name, 0.0, change)


def _gain(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    inverse = 1.0 + sign * amount / motion.rms(motion.torque)
    gain = 1.0 / inverse if inverse > 0.0 else np.inf
    return Spike({"gain": gain}, "gain", 1.0, lambda s: {"torque": inverse * s["torque"]})


def _ripple(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    order, phase = _ORDERS[sign], 0.7 * sign
    high = amount / motion.rms(np.sin(order * motion.angle + phase))

    def change(signals: Signals) -> dict[str, Array]:
        wave = high * np.sin(order * signals["angle"] + phase)
        return {"torque": signals["torque"] - wave}

    numbers = {"amplitude": high, "order": float(order), "phase": phase}
    return Spike(numbers, "amplitude", 0.0, change)


def _encoder(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    viscous = machine.terms.get("winch_viscous_friction", {}).get("coefficient", 0.0)
    shown = machine.inertia * motion.acceleration + viscous * motion.speed
    scale = 1.0 + sign * amount / motion.rms(shown)
    return Spike({"scale": scale}, "scale", 1.0, lambda s: {"angle": scale * s["angle"]})


def _late_torque(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    step = 1.0 / machine.rate
    delay = amount / motion.rms(np.gradient(motion.torque, step))
    return Spike(
        {"delay": delay}, "delay", 0.0, lambda s: {"torque": _later(s["torque"], delay / step)}
    )


def _tension_gain(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    gain = 1.0 + sign * amount / (machine.radius * motion.rms(motion.tension))
    return Spike({"gain": gain}, "gain", 1.0, lambda s: {"tension": gain * s["tension"]})


def _tension_bias(machine: Machine, sign: float, amount: float, motion: Motion) -> Spike:
    # Always a pull: no cable pushes.
    bias = amount / machine.radius
    return Spike({"bias": bias}, "bias", 0.0, lambda s: {"tension": s["tension"] + bias})


_SENSED = {
    "winch_torque_gain": _gain,
    "winch_torque_ripple": _ripple,
    "encoder_scale": _encoder,
    "torque_delay": _late_torque,
    "tension_gain": _tension_gain,
    "tension_bias": _tension_bias,
}

# Of a body on springs that are measured.
_POSE = ("sway", "heave", "roll")


def _spring_bias(sign: float, amount: float, signals: Signals, rate: float) -> Spike:
    bias = sign * amount
    return Spike({"bias": bias}, "bias", 0.0, lambda s: {"tension": s["tension"] + bias})


def _spring_gain(sign: float, amount: float, signals: Signals, rate: float) -> Spike:
    gain = 1.0 + sign * amount / float(np.sqrt(np.mean(signals["tension"] ** 2)))
    return Spike({"gain": gain}, "gain", 1.0, lambda s: {"tension": gain * s["tension"]})


def _late_pose(sign: float, amount: float, signals: Signals, rate: float) -> Spike:
    """Delay the pose by as much as changes the spring's tension by an amount."""
    delay = amount / float(np.sqrt(np.mean(np.gradient(signals["tension"], 1.0 / rate) ** 2)))

    def change(measured: Signals) -> dict[str, Array]:
        return {name: _later(measured[name], delay * rate) for name in _POSE}

    return Spike({"delay": delay}, "delay", 0.0, change)


def _skewed_pose(sign: float, amount: float, signals: Signals, rate: float) -> Spike:
    """Stretch the pose's stamps, late by as much as `_late_pose` after half of the recording."""
    late = _late_pose(sign, amount, signals, rate).parameters["delay"]
    skew = sign * late / (0.5 * len(signals["tension"]) / rate)

    def change(measured: Signals) -> dict[str, Array]:
        rows = np.arange(len(measured["tension"]), dtype=float)
        return {name: np.interp(rows / (1.0 + skew), rows, measured[name]) for name in _POSE}

    return Spike({"skew": skew}, "skew", 0.0, change)


_LOCKED = {
    "tension_bias": _spring_bias,
    "tension_gain": _spring_gain,
    "pose_delay": _late_pose,
    "clock_skew": _skewed_pose,
}


def _later(values: Array, rows: float) -> Array:
    """Return values so many rows later, between rows along a line."""
    at = np.arange(len(values), dtype=float)
    return np.interp(at - rows, at, values)
