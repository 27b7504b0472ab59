"""Which samples of a channel no machine can have made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_checks.channel import Channel
from cspm_checks.outliers import Outliers, find_outliers
from cspm_checks.stuck import is_held
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
SHOWN = 10
SHOWN_SIZES = 3
_SIGMAS = 6.0  # four, and what the bend of the motion adds
_ANGLES = ("roll", "pitch", "yaw")
_AS_FAST = 2.0
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
    where = channel.where
    steady = channel.field.partition("/")[0] in _STEADY
    out = []
    if len(found.spikes) and (steady or _beyond_the_rest(values[rows], found.spikes)):
        text = f"{len(found.spikes)} samples leave and come back at once"
        spike = at_instants(where, "spike", text, seconds[found.spikes])
        out.append(replace(spike, mend={where: {"spikes": "mask"}}))
    if len(found.zeros):
        text = f"{len(found.zeros)} samples are exactly 0 between others that are not"
        out.append(at_instants(where, "zero", text, seconds[found.zeros]))
    if found.period is not None and steady:
        out.append(_rollover(channel, found, seconds[found.jumps]))
    elif steady:
        out += _jumps(channel, found, values[rows], seconds)
    return out


def _jumps(channel: Channel, found: Outliers, values: Array, seconds: Array) -> list[Suspicion]:
    """Return steps that stay, but for those with which a held value is let go."""
    let_go = np.array(
        [
            is_held(values, int(row)) and abs(size) <= _goes_on(values, int(row))
            for row, size in zip(found.jumps, found.sizes, strict=True)
        ],
        dtype=np.bool_,
    )
    out = []
    jumps, sizes = found.jumps[~let_go], found.sizes[~let_go]
    if len(jumps):
        shown = ", ".join(f"{size:+.6g}" for size in sizes[:SHOWN_SIZES])
        text = f"{len(jumps)} steps that no motion explains, {shown} {channel.quantity}: a reset?"
        jump = at_instants(channel.where, "jump", text, seconds[jumps])
        # Steps of which one is of a held value are not all resets.
        mend = {} if let_go.any() else {channel.where: {"jumps": "join"}}
        out.append(replace(jump, mend=mend))
    if let_go.any() and channel.field not in "xyz":
        text = f"its last value is held {let_go.sum()} times and then steps to where it is"
        held = at_instants(channel.where, "stuck", text, seconds[found.jumps[let_go]])
        out.append(replace(held, remedy="`drop` these stretches; never `jumps: join`"))
    return out


def _goes_on(values: Array, row: int) -> float:
    """Return how far a signal may have moved while its value was held before a row."""
    changes = np.flatnonzero(np.diff(values[:row]) != 0.0)
    start = int(changes[-1]) + 1 if len(changes) else 0
    steps = np.abs(np.diff(values))
    beside = np.concatenate([steps[max(start - 5, 0) : start], steps[row : row + 5]])
    largest = float(beside.max()) if len(beside) else 0.0
    return _AS_FAST * largest * (row - start)


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
    remedy, mend = f"`wrap: {wrap:.10g}`", {channel.where: {"wrap": wrap}}
    return Suspicion(one.where, one.kind, one.text, numbers, one.at_s, remedy, mend)


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
