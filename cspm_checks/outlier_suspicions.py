"""Which samples of a channel no machine can have made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.channel import Channel
from cspm_checks.outliers import Outliers, find_outliers
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
SHOWN = 10
SHOWN_SIZES = 3
_SIGMAS = 6.0  # four, and what the bend of the motion adds
_ANGLES = ("roll", "pitch", "yaw")
_STEADY = ("position", "x", "y", "z")
"""What cannot step; torques, tensions and velocities can, or nearly."""


def outlier_suspicions(
    channel: Channel, values: Array, stamp_ns: NDArray[np.int64], origin_ns: int
) -> list[Suspicion]:
    """Return impossible samples of a channel.

    Args:
        channel: which it is.
        values: shape (n,) [SI].
        stamp_ns: shape (n,).
        origin_ns: instants count from it [ns].
    """
    found, rows = find_outliers(values, stamp_ns)
    seconds: Array = np.asarray((stamp_ns[rows] - origin_ns) * 1e-9, dtype=np.float64)
    where, unit = channel.where, f" {channel.quantity}"
    steady = channel.field.partition("/")[0] in _STEADY
    out = []
    if len(found.spikes) and (steady or _beyond_the_rest(values[rows], found.spikes)):
        text = f"{len(found.spikes)} samples leave and come back at once"
        out.append(at_instants(where, "spike", text, seconds[found.spikes]))
    if len(found.zeros):
        text = f"{len(found.zeros)} samples are exactly 0 between others that are not"
        out.append(at_instants(where, "zero", text, seconds[found.zeros]))
    if found.period is not None and steady:
        out.append(_rollover(channel, found, seconds[found.jumps]))
    elif len(found.jumps) and steady:
        sizes = ", ".join(f"{size:+.6g}" for size in found.sizes[:SHOWN_SIZES])
        text = f"{len(found.jumps)} steps that no motion explains, {sizes}{unit}: a reset?"
        out.append(at_instants(where, "jump", text, seconds[found.jumps]))
    return out


def _beyond_the_rest(values: Array, spikes: NDArray[np.intp]) -> bool:
    """Return whether a spike is farther out than all other values are apart.

    A controller answers to a step of a coarse encoder by a short torque within its usual range.
    """
    rest = np.delete(values, spikes)
    outside = np.maximum(values[spikes] - rest.max(), rest.min() - values[spikes])
    return bool((outside > np.ptp(rest)).any())


def _rollover(channel: Channel, found: Outliers, seconds: Array) -> Suspicion:
    factor = abs(channel.factor)
    period, error = (found.period or 0.0) / factor, found.period_error / factor
    wrap = nearest_round(period, _SIGMAS * error)
    text = f"starts again at the other end {len(seconds)} times: a counter of {wrap:.10g}"
    text += f" ± {2 * error:.2g}" if error else ""
    one = at_instants(channel.where, "rollover", text, seconds)
    numbers = {**one.numbers, "period": period, "error": error}
    return Suspicion(one.where, one.kind, one.text, numbers, one.at_s, f"`wrap: {wrap:.10g}`")


def nearest_round(value: float, error: float) -> float:
    """Return a power of two, a half, one or two turns, or the number of fewest digits near a value.

    Args:
        value: above 0.
        error: how far it may be from what is returned.
    """
    bits = 2.0 ** round(np.log2(value))
    turn = 2.0 * np.pi
    for usual in (bits, turn / 2.0, turn, 2.0 * turn):
        if abs(usual - value) <= error:
            return float(usual)
    for digits in range(-6, 12):
        if abs(round(value, digits) - value) <= error:
            return round(value, digits)
    return value


def at_instants(where: str, kind: str, text: str, seconds: Array) -> Suspicion:
    """Return a suspicion whose text ends with the first instants [s] where it shows."""
    first = ", ".join(f"{instant:.6g}" for instant in seconds[:SHOWN_SIZES])
    text += f", at {first} s{', …' if len(seconds) > SHOWN_SIZES else ''}"
    return Suspicion(
        where, kind, text, {"count": float(len(seconds))}, tuple(seconds[:SHOWN].tolist())
    )
