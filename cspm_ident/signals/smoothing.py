"""From noisy samples to smooth functions of time, without phase.

Whatever enters one equation is smoothed equally, or the difference of the smoothings would look
like physics: so the band is chosen once per sensor and is reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.signal import butter, sosfiltfilt, welch
from scipy.stats import chi2

from cspm_ident.signals.samples import Samples, stretches

Array = NDArray[np.float64]

ORDER = 4
# Below a fifth of all samples, the upper end of the spectrum is taken for noise.
_NOISE_SHARE = 0.2
_ABOVE_NOISE = 4.0
# How often noise alone may stand out at a frequency; a thousand of them are looked at.
_BY_CHANCE = 1e-6
_MARGIN = 2.0
_HIGHEST = 0.4
_SEGMENT_S = 4.0
_SEGMENTS = 64
# Knots per period of the highest frequency kept: a spline's error is below 1e-5 of the signal.
_KNOTS = 40.0


@dataclass(frozen=True, eq=False)
class Smooth:
    """A sensor as smooth functions of time, one piece per stretch without hole.

    Attributes:
        spans: beginning and end of each piece [s], shape (m, 2).
        pieces: cubic splines of the smoothed values, less their first.
        firsts: of each piece, shape (m, width).
        band: what was kept [Hz]; infinite where nothing was smoothed.
    """

    spans: Array
    pieces: tuple[BSpline, ...]
    firsts: Array
    band: float

    def at(self, times: Array, derivative: int = 0) -> Array:
        """Return the values at `times` (k,) [s], or a time derivative; NaN in holes. (k, width)."""
        width = self.pieces[0].c.shape[1]
        out = np.full((len(times), width), np.nan)
        for (start, end), piece, first in zip(self.spans, self.pieces, self.firsts, strict=True):
            inside = (times >= start) & (times <= end)
            if inside.any():
                out[inside] = piece(times[inside], derivative)
                out[inside] += first if derivative == 0 else 0.0
        return out


def smooth(samples: Samples, band: float | None = None) -> Smooth:
    """Return the samples without what lies above `band` [Hz]; absent: see `band_of`.

    What was returned is kept with the samples.
    """
    return samples.kept((smooth, band), lambda: smoothed(samples, band))


def smoothed(samples: Samples, band: float | None = None) -> Smooth:
    """Return the same as `smooth`, which is not kept: of a long recording it is much memory."""
    values, kept = filtered(samples, band)
    skip = max(1, int(samples.rate / (_KNOTS * kept)))
    spans, pieces, firsts = [], [], []
    for span, (times, _) in zip(samples.spans, samples.clocks, strict=True):
        if len(times) < 4 * skip:
            continue
        knots = np.arange(0, len(times), skip)
        if knots[-1] != len(times) - 1:
            knots = np.append(knots, len(times) - 1)
        spans.append((times[0], times[-1]))
        firsts.append(values[span][0])
        # Basis splines: polynomials of each piece are four times the memory. Less the first value,
        # so that what stands still has no speed, not even one of rounding.
        piece = make_interp_spline(times[knots], values[span][knots] - firsts[-1])
        # Other values at the same times have the same knots, of which one copy is enough.
        own = samples.shared.setdefault((span.start, skip), piece.t)
        pieces.append(BSpline.construct_fast(own, piece.c, piece.k))
    begun = np.array(firsts).reshape(len(firsts), values.shape[1])
    return Smooth(np.array(spans).reshape(len(spans), 2), tuple(pieces), begun, kept)


def filtered(samples: Samples, band: float | None = None) -> tuple[Array, float]:
    """Return the smoothed values at the samples themselves, and the band that was kept [Hz].

    The filter runs forwards and backwards along the sensor's own clock: stamps that scatter about
    it are taken for late, lost samples are put in by straight lines. So are all where stamps follow
    no even clock.
    """
    rate = samples.rate
    band = band_of(samples) if band is None else band
    if not band < _HIGHEST * rate:
        return samples.values, float("inf")
    sos = butter(ORDER, band, fs=rate, output="sos")
    out = samples.values.astype(float)
    for span, (_, place) in zip(samples.spans, samples.clocks, strict=True):
        if span.stop - span.start < 4:
            continue
        whole = np.arange(round(place[-1]) + 1)
        padding = min(len(whole) - 1, round(3.0 / samples.interval))
        # One column after the other: of a long recording all at once are much memory.
        for column in out[span].T:
            filled = np.interp(whole, place, column)
            slow = sosfiltfilt(sos, filled, padtype="odd", padlen=padding)
            column[:] = np.interp(place, whole, slow)
    return out, band


def band_of(samples: Samples) -> float:
    """Return the frequency [Hz] up to which the sensor shows more than its noise, with a margin.

    Its noise is what its spectrum has in the highest fifth of the frequencies. Infinite where the
    spectrum exceeds the noise up to there, or is too short to show it.
    """
    longest = max(samples.spans, key=lambda span: span.stop - span.start)
    values = samples.values[longest]
    length = min(len(values) - 1, round(_SEGMENT_S * samples.rate))
    if length < 32:
        return float("inf")
    steps = stretches(np.diff(values, axis=0), length, _SEGMENTS)
    # Where stretches are joined no segment may lie.
    overlap = None if len(steps) == len(values) - 1 else 0
    frequencies, power = welch(
        steps, samples.rate, nperseg=length, noverlap=overlap, detrend="linear", axis=0
    )
    # Of differences, since drift leaks over the whole spectrum; undone by their gain.
    gain = 4.0 * np.sin(np.pi * frequencies[1:] / samples.rate) ** 2
    power, frequencies = power[1:] / gain[:, None], frequencies[1:]
    top = round((1.0 - _NOISE_SHARE) * len(frequencies))
    noise = np.median(power[top:], axis=0)
    above = _above_noise(len(values) - 1, length)
    standing_out = (power[:top] > above * noise) & (noise > 0.0)
    if not standing_out.any():
        return float(frequencies[0] * _MARGIN) if (noise > 0.0).any() else float("inf")
    last = int(np.flatnonzero(_lasting(standing_out).any(axis=1)).max(initial=0))
    return float(frequencies[last] * _MARGIN)


def _above_noise(samples: int, segment: int) -> float:
    """Return how far above its median noise must lie to be none, by the spectrum's averages.

    A mean over segments with half overlap scatters as χ² (Welch 1967), so that few segments let
    noise stand out by chance.
    """
    count = max(1, (samples - segment // 2) // (segment - segment // 2))
    freedom = 2.0 if count == 1 else 36.0 * count**2 / (19.0 * count - 1.0)
    return max(_ABOVE_NOISE, float(chi2.isf(_BY_CHANCE, freedom) / chi2.median(freedom)))


def _lasting(standing_out: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where two neighbouring frequencies stand out: one alone happens by chance."""
    pairs = standing_out[1:] & standing_out[:-1]
    return np.concatenate([pairs, np.zeros((1, pairs.shape[1]), dtype=bool)])
