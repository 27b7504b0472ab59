"""From the complex amplitudes of a periodic motion to the knots of its spline."""

from __future__ import annotations

from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.sea import Array, Complex
from cspm_msgs_py.errors import InputError

COARSEST = 0.02  # s
TOLERANCE = 5e-9  # m or rad, of the spline against the sum of waves
MOST_KNOTS = 2_000_000


def knot_count(period: float, highest_frequency: float, excursion: float) -> int:
    """Return how many knots per period the motion needs.

    A quintic Hermite spline misses by at most h⁶/46080·max|p⁽⁶⁾|, and by Bernstein's inequality
    the sixth derivative of a motion with |p| ≤ `excursion` and no frequency above f is at most
    (2πf)⁶·excursion.

    Args:
        period: [s].
        highest_frequency: f [Hz].
        excursion: bound of the displacement [m or rad].

    Raises:
        InputError: the period holds more waves than can be stored.
    """
    finest = (46080.0 * TOLERANCE / max(excursion, 1e-12)) ** (1.0 / 6.0)
    spacing = min(COARSEST, finest / (2.0 * pi * highest_frequency))
    return checked_count(ceil(period / spacing - 1e-9))


def checked_count(count: int) -> int:
    """Return `count`.

    Raises:
        InputError: it is more than can be stored.
    """
    if count > MOST_KNOTS:
        raise InputError(
            f"motion: {count} knots, allowed: at most {MOST_KNOTS} (a shorter time or lower"
            " frequencies)"
        )
    return count


def synthesise(amplitude: Complex, harmonic: NDArray[np.int64], period: float, count: int) -> Array:
    """Return Re Σ amplitude·exp(2πi·harmonic·t/period) and two derivatives, shape (count, 18).

    Args:
        amplitude: shape (n, 6).
        harmonic: shape (n,), all below count/2.
        period: [s].
        count: number of equally spaced instants, the first at t = 0.
    """
    rotation = 2j * pi * harmonic[:, None] / period
    spectrum = np.zeros((count // 2 + 1, 18), dtype=np.complex128)
    spectrum[harmonic] = np.hstack([amplitude, rotation * amplitude, rotation**2 * amplitude])
    return np.asarray(np.fft.irfft(0.5 * count * spectrum, n=count, axis=0))


def start_from_rest(knots: Array, spacing: float, ramp: float, duration: float) -> Array:
    """Return a periodic motion under an envelope that starts it, at least `duration` long.

    The envelope 10s³ - 15s⁴ + 6s⁵, s = t/ramp, has no rate and acceleration at either end, so
    that the motion leaves rest without a jump in acceleration.

    Args:
        knots: one period of displacement, rate and acceleration, shape (n, 18).
        spacing: time between knots [s].
        ramp: length of the envelope [s], > 0.
        duration: how long the motion must last [s].

    Raises:
        InputError: the duration requires more knots than can be stored.
    """
    count = checked_count(ceil(duration / spacing) + 2)
    full = knots[np.arange(count) % len(knots)]
    pose, rate, acceleration = full[:, :6], full[:, 6:12], full[:, 12:]
    time = np.linspace(0.0, (count - 1) * spacing, count)
    e, e1, e2 = (value[:, None] for value in envelope(time, ramp))
    return np.hstack(
        [
            e * pose,
            e * rate + e1 * pose,
            e * acceleration + 2.0 * e1 * rate + e2 * pose,
        ]
    )


def envelope(time: Array, ramp: float) -> tuple[Array, Array, Array]:
    """Return the minimum-jerk step from 0 at t = 0 to 1 at t = ramp and its two derivatives."""
    s = np.clip(time / ramp, 0.0, 1.0)
    value = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate = 30.0 * s**2 * (1.0 - s) ** 2 / ramp
    acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / ramp**2
    return value, rate, acceleration
