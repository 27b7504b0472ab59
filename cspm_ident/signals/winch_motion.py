"""Winch motion from encoders and, where the drives report it, speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from cspm_ident.signals.samples import Samples, digest
from cspm_ident.signals.smoothing import Smooth, smooth, smoothed

Array = NDArray[np.float64]

# Encoders alone: above this band their steps would look like speed.
ENCODER_BAND_HZ = 100.0
# With speeds: slow motion from the encoders, fast from the speeds.
CROSSOVER_HZ = 5.0
# Of the crossover's periods: so near a stretch's ends the filters have one side only.
_ENDS = 2.0
# Instants at which both are compared, ten per period of the fastest motion that is left.
_AGREEING_HZ = 10.0 * CROSSOVER_HZ
# Largest share of the speed's variance at which encoder and speed may disagree to be joined.
_DISAGREEMENT = 0.02


class WinchMotion(NamedTuple):
    """Angles and speeds on common times, consistent with each other.

    Attributes:
        angles: shape (k, n) [rad]; NaN in holes.
        speeds: shape (k, n) [rad/s].
        band: highest frequency kept [Hz]; infinite where the speeds were used.
    """

    angles: Array
    speeds: Array
    band: float


def winch_motion(angle: Samples, speed: Samples | None, times: Array) -> WinchMotion:
    """Return the motion at `times` (k,) [s].

    An encoder's steps hide fast motion, which the drive's speed shows; the speed drifts when it is
    summed up, which the encoder does not. So each gives the band in which it is better, where both
    agree in the band that they share. What was returned is kept with the angles.
    """
    return angle.kept(
        (winch_motion, speed, digest(times)), lambda: joined_motion(angle, speed, times)
    )


def joined_motion(angle: Samples, speed: Samples | None, times: Array) -> WinchMotion:
    """Return the same as `winch_motion`, not kept: of a long recording it is much memory."""
    if speed is None or not angle.kept((_agree, speed), lambda: _agree(angle, speed)):
        alone = smooth(angle, ENCODER_BAND_HZ)
        return WinchMotion(alone.at(times), alone.at(times, 1), alone.band)
    even = speed.even
    fast = np.stack([np.interp(times, even.times, c) for c in even.values.T], axis=1)
    summed = np.empty_like(fast)
    rest = np.empty_like(angle.values)
    at = angle.even.times
    for i, column in enumerate(even.values.T):
        # One column after the other: of a long recording all at once are much memory.
        path = _turned(even.times, column)
        rest[:, i] = angle.values[:, i] - path(at)
        summed[:, i] = path(times)
    slow = smoothed(angle.of_others(rest), CROSSOVER_HZ)
    return WinchMotion(summed + slow.at(times), fast + slow.at(times, 1), float("inf"))


def _turned(times: Array, speeds: Array) -> CubicHermiteSpline:
    """Return what speeds (k,) sum up to, of fourth order in the time between them.

    By trapezoids a rope's swing of 15 Hz, read at 1 kHz, is a thousandth too small: as much as a
    rig's sensors show.
    """
    steps = np.diff(times)
    bends = np.diff(np.gradient(speeds, times))
    parts = 0.5 * steps * (speeds[1:] + speeds[:-1]) - steps**2 / 12.0 * bends
    return CubicHermiteSpline(times, np.concatenate([[0.0], np.cumsum(parts)]), speeds)


def _agree(angle: Samples, speed: Samples) -> bool:
    """Return whether the speeds are the angles' derivatives, in the band that both show well."""
    slow_angle, slow_speed = smoothed(angle, CROSSOVER_HZ), smoothed(speed, CROSSOVER_HZ)
    # Both are slow: their variances need no more instants.
    times = _inside(slow_angle, speed.times[:: max(1, int(speed.rate / _AGREEING_HZ))])
    derived, said = slow_angle.at(times, 1), slow_speed.at(times)
    apart, whole = np.nanvar(derived - said, axis=0), np.nanvar(said, axis=0)
    # A winch at rest shows no motion; its speed is noise, and small.
    return bool((apart <= _DISAGREEMENT * whole.max()).all())


def _inside(slow: Smooth, times: Array) -> Array:
    """Return the times that are not near a stretch's ends; all of them where none is left."""
    end = _ENDS / CROSSOVER_HZ
    inside = np.zeros(len(times), dtype=np.bool_)
    for first, last in slow.spans:
        inside |= (times >= first + end) & (times <= last - end)
    return times[inside] if inside.any() else times
