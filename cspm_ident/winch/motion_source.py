"""Whether a winch's accelerations stand out of the noise of what they are taken from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.prediction_noise import prediction_noise
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import band_of
from cspm_ident.winch.identification import linear_effects, winch_records
from cspm_ident.winch.recording import WinchSignals
from cspm_ident.winch.weak_form import HALF_WIDTH_S, first_of, make_window

Array = NDArray[np.float64]

# Noise in a regressor makes least squares too small by its share of the variance (attenuation,
# Fuller, Measurement Error Models, 1987, 1.1). A tenth of an inertia is more than any interval
# here, so that from there on no number is given.
LARGEST_SHARE = 0.1
# Of the interval: readings that scatter more about their usual distance follow no even clock. Those
# that do are put on it, and the scatter that is left is rounding.
_UNEVEN = 0.01
# Samples over which a reported speed is summed, and the largest share of the angle's changes, as a
# variance, that it may miss: a tenth of the speed, less than the inertia's interval would say.
_STRETCH = 10
_FEWEST = 4
_DISAGREEMENT = 0.01


class MotionSource(NamedTuple):
    """What a winch's accelerations are taken from.

    Attributes:
        signals: the readings, with the drive's speed where accelerations are taken from it.
        noise_share: of the variance of the accelerations, as far as speed and friction do not say
            the same.
        stamp_error: standard deviation of the stamps that the readings' scatter in motion is worth
            [s].
        interval: usual time between readings [s].
    """

    signals: list[WinchSignals]
    noise_share: float
    stamp_error: float
    interval: float

    @property
    def shows_acceleration(self) -> bool:
        """Whether an inertia may be taken from it."""
        return self.noise_share <= LARGEST_SHARE


def motion_source(
    signals: Sequence[WinchSignals],
    speeds: Sequence[Samples | None],
    effects: Sequence[str],
    *,
    reversals: bool,
) -> MotionSource:
    """Return the angle as the source of accelerations, or the drive's speed if that is too noisy.

    Args:
        signals: readings of one winch, one entry per recording.
        speeds: as the drive reports them [rad/s], one column, entry by entry; None where it does
            not.
        effects: see `identify_winch`.
        reversals: see `identify_winch`.

    Raises:
        InputError: see `identify_winch`.
    """
    own = source_of(signals, effects, reversals=reversals)
    if own.shows_acceleration or any(speed is None for speed in speeds):
        return own
    reported = [replace(s, speed=speed) for s, speed in zip(signals, speeds, strict=True)]
    other = source_of(reported, effects, reversals=reversals)
    if other.noise_share < own.noise_share:
        return other._replace(stamp_error=own.stamp_error)
    return own


def source_of(
    signals: Sequence[WinchSignals], effects: Sequence[str], *, reversals: bool
) -> MotionSource:
    """Return signals as the source of accelerations, with the noise that these have.

    Args:
        signals: readings of one winch, one entry per recording; the torque does not matter.
        effects: what may be confounded with the inertia.
        reversals: see `identify_winch`.

    Raises:
        InputError: see `identify_winch`.
    """
    records = winch_records(signals, linear_effects(effects), HALF_WIDTH_S, reversals=reversals)
    columns = np.concatenate([record.regressors[:, 0] for record in records])
    inertia, others = columns[:, 0], columns[:, 1:]
    beyond = inertia - others @ np.linalg.lstsq(others, inertia, rcond=None)[0]
    noise = [_acceleration_noise(each) for each in signals]
    counts = [len(each.angle.times) for each in signals]
    variance, whole = np.average(noise, weights=counts), float(np.mean(beyond**2))
    share = float(variance / whole) if whole > variance else 1.0
    angle, speed = np.average([_scatter(each) for each in signals], axis=0, weights=counts)
    interval = float(np.median([each.angle.interval for each in signals]))
    return MotionSource(list(signals), share, float(np.sqrt(angle / max(speed, 1e-300))), interval)


def _acceleration_noise(signals: WinchSignals) -> float:
    """Return the variance that noise of the readings has in weighted accelerations [rad²/s⁴]."""
    step = signals.angle.interval
    half = max(2, round(HALF_WIDTH_S / step))
    if signals.speed is not None:
        return prediction_noise(signals.speed) * float(np.sum(first_of(half, step) ** 2))
    second = make_window(half, step).second
    size = 16 * len(second)
    power = np.abs(np.fft.rfft(second, size)) ** 2
    if _on_even_clock(signals.angle):
        # What the smoothing of the angle takes out reaches no window.
        power[np.fft.rfftfreq(size, step) > band_of(signals.angle)] = 0.0
    power[1:-1] *= 2.0
    return prediction_noise(signals.angle) * float(power.sum() / size)


def _on_even_clock(samples: Samples) -> bool:
    """Return whether samples are smoothed at the instants at which they then count."""
    clock = samples.even.times
    apart = np.diff(clock)
    uneven = np.abs(apart - samples.interval)[~samples.gaps]
    return float(np.mean(uneven)) < _UNEVEN * samples.interval


def _scatter(signals: WinchSignals) -> tuple[float, float]:
    """Return the variance of the angle's scatter [rad²] and the mean square speed [rad²/s²]."""
    times, angles = signals.angle.times, signals.angle.values[:, 0]
    speed = np.diff(angles) / np.maximum(np.diff(times), signals.angle.interval)
    return prediction_noise(signals.angle), float(np.mean(speed**2))


def speed_agrees(angle: Samples, speed: Samples) -> bool:
    """Return whether a reported speed adds up to the angle's change, over stretches of samples.

    Stamps that scatter say little over one sample, and nothing over many.

    Args:
        angle: [rad], one column.
        speed: [rad/s], one column.
    """
    times = angle.times[::_STRETCH]
    if len(times) < _FEWEST:
        return False
    fine = speed.times
    summed = np.concatenate([[0.0], np.cumsum(np.diff(fine) * _middles(speed.values[:, 0]))])
    moved, added = np.diff(angle.values[::_STRETCH, 0]), np.diff(np.interp(times, fine, summed))
    # Nobody knows what happened in a hole.
    seen = np.diff(times) < 2.0 * _STRETCH * angle.interval
    moved, added = moved[seen], added[seen]
    whole = float(np.sum(moved**2))
    return float(np.sum((moved - added) ** 2)) <= _DISAGREEMENT * whole


def _middles(values: Array) -> Array:
    return np.asarray(0.5 * (values[1:] + values[:-1]))
