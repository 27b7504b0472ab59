"""Which samples of a channel no machine can have made, and which were mended."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.checks.suspicion import Suspicion
from cspm_ident.importing.import_plan import PlannedField
from cspm_ident.importing.mending import Mended, find_outliers
from cspm_ident.importing.outliers import Outliers

Array = NDArray[np.float64]
SHOWN = 10
_FEW = 3
_SIGMAS = 6.0  # four, and what the bend of the motion adds
_ANGLES = ("roll", "pitch", "yaw")
_STEADY = ("position", "x", "y", "z")
"""What cannot step; torques, tensions and velocities can, or nearly."""


def outlier_suspicions(
    where: str, field: PlannedField, values: Array, stamp_ns: NDArray[np.int64], origin_ns: int
) -> list[Suspicion]:
    """Return impossible samples of a channel.

    Args:
        where: topic and field.
        field: as it is planned.
        values: shape (n,) [SI].
        stamp_ns: shape (n,).
        origin_ns: instants count from it [ns].
    """
    found, rows = find_outliers(values, stamp_ns)
    seconds: Array = np.asarray((stamp_ns[rows] - origin_ns) * 1e-9, dtype=np.float64)
    unit = f" {field.conversion.quantity}" if field.conversion else ""
    steady = field.name.partition("/")[0] in _STEADY
    out = []
    if len(found.spikes) and (steady or _beyond_the_rest(values[rows], found.spikes)):
        text = f"{len(found.spikes)} samples leave and come back at once"
        out.append(_at(where, "spike", text, seconds[found.spikes]))
    if len(found.zeros):
        text = f"{len(found.zeros)} samples are exactly 0 between others that are not"
        out.append(_at(where, "zero", text, seconds[found.zeros]))
    if found.period is not None and steady:
        out.append(_rollover(where, field, found, seconds[found.jumps]))
    elif len(found.jumps) and steady:
        sizes = ", ".join(f"{size:+.6g}" for size in found.sizes[:_FEW])
        text = f"{len(found.jumps)} steps that no motion explains, {sizes}{unit}: a reset?"
        out.append(_at(where, "jump", text, seconds[found.jumps]))
    return out


def _beyond_the_rest(values: Array, spikes: NDArray[np.intp]) -> bool:
    """Return whether a spike is farther out than all other values are apart.

    A controller answers to a step of a coarse encoder by a short torque within its usual range.
    """
    rest = np.delete(values, spikes)
    outside = np.maximum(values[spikes] - rest.max(), rest.min() - values[spikes])
    return bool((outside > np.ptp(rest)).any())


def _rollover(where: str, field: PlannedField, found: Outliers, seconds: Array) -> Suspicion:
    factor = abs(field.conversion.factor) if field.conversion else 1.0
    period, error = (found.period or 0.0) / factor, found.period_error / factor
    wrap = nearest_round(period, _SIGMAS * error)
    text = f"starts again at the other end {len(seconds)} times: a counter of {wrap:.10g}"
    text += f" ± {2 * error:.2g}" if error else ""
    one = _at(where, "rollover", text, seconds)
    numbers = {**one.numbers, "period": period, "error": error}
    return Suspicion(where, one.kind, one.text, numbers, one.at_s, f"`wrap: {wrap:.10g}`")


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


def _at(where: str, kind: str, text: str, seconds: Array) -> Suspicion:
    first = ", ".join(f"{instant:.6g}" for instant in seconds[:_FEW])
    text += f", at {first} s{', …' if len(seconds) > _FEW else ''}"
    return Suspicion(
        where, kind, text, {"count": float(len(seconds))}, tuple(seconds[:SHOWN].tolist())
    )


def mended_suspicions(where: str, mended: Mended, seconds: Array) -> list[Suspicion]:
    """Return what was mended in a channel as asked; `seconds` are those of its rows, (n,)."""
    found = []
    if len(mended.masked):
        text = f"{len(mended.masked)} samples were masked"
        found.append(_at(where, "mended", text, seconds[mended.masked]))
    if len(mended.joined):
        sizes = ", ".join(f"{size:+.6g}" for size in mended.sizes[:_FEW])
        text = f"{len(mended.joined)} steps were taken out, {sizes}"
        found.append(_at(where, "mended", text, seconds[mended.joined]))
    return found
