"""Mains hum: one line at 50 or 60 Hz in what a sensor or drive reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.channel import Channel
from cspm_checks.motion import even
from cspm_checks.series import SensorSeries
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
MAINS = (50.0, 60.0)  # Hz
TOLERANCE = 0.1
"""Hz that a network's frequency is off, ENTSO-E's and NERC's ordinary range taken twice."""
BESIDE = 5.0  # Hz to each side that the line is held against
STANDS_OUT = 100.0
"""Power over the median beside: of ten lines of white noise one does once in 1e29."""
SHARE = 0.1
"""Of the variance above 10 Hz: less is hidden by noise."""
_SLOW = 10.0
_LONGEST = 60_000


class Hum(NamedTuple):
    """A line of the mains: frequency [Hz] and amplitude in the channel's unit."""

    frequency: float
    amplitude: float


def hum_suspicions(channel: Channel, series: SensorSeries) -> list[Suspicion]:
    """Return whether a channel has a line of the mains."""
    if (hum := mains_hum(series)) is None:
        return []
    text = f"a line of {hum.amplitude:.3g} {channel.quantity} at {hum.frequency:.4g} Hz: mains hum?"
    return [Suspicion(channel.where, "hum", text, hum._asdict())]


def mains_hum(series: SensorSeries) -> Hum | None:
    """Return the line of the mains in a channel, None where there is none."""
    regular = even(series)
    if regular is None:
        return None
    _, values, step = regular
    values = values[:_LONGEST]
    if len(values) * step < 4.0 / BESIDE * 2.0 or 0.5 / step < MAINS[0] + BESIDE:
        return None
    window = np.hanning(len(values))
    power = np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(len(values), step)
    width = 2.0 / (len(values) * step)
    fast = float(power[frequency > _SLOW].sum())
    for mains in MAINS:
        near = np.abs(frequency - mains) <= max(TOLERANCE, width)
        beside = (np.abs(frequency - mains) <= BESIDE) & (np.abs(frequency - mains) > 5.0 * width)
        if not near.any() or beside.sum() < 10 or not fast > 0.0:
            continue
        line = np.abs(frequency - mains) <= max(TOLERANCE, width) + width
        top = float(power[near].max())
        if top > STANDS_OUT * float(np.median(power[beside])) and power[line].sum() > SHARE * fast:
            above = float(np.sum(power[line] - np.mean(power[beside])))
            variance = 2.0 * above / (len(values) * float((window**2).sum()))
            return Hum(
                float(frequency[near][np.argmax(power[near])]), float(np.sqrt(2.0 * variance))
            )
    return None
