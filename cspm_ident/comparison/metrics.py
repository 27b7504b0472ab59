"""How far a simulation is from what was measured."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import coherence, correlate

from cspm_ident.signals.samples import stretches

Array = NDArray[np.float64]

LONGEST_LAG_S = 0.5
BINS = 8
_SEGMENT_S = 4.0
_MOST_FREQUENCIES = 200
# Longer records are represented by stretches of themselves, spread evenly.
_STRETCHES = 16
_STRETCH_S = 10.0
_SEGMENTS = 64
_MOST_SAMPLES = 150_000


class Bin(NamedTuple):
    """The error where a quantity lies near one value.

    Attributes:
        centre: of the bin, in the quantity's unit.
        bias: mean error there.
        rms: of the error there.
        samples: how many.
    """

    centre: float
    bias: float
    rms: float
    samples: int


def nrmse(measured: Array, simulated: Array) -> float:
    """Return the RMS error over the measured signal's standard deviation, (n,) each."""
    return float(np.sqrt(np.mean((measured - simulated) ** 2)) / np.std(measured))


def best_lag(measured: Array, simulated: Array, interval: float) -> float:
    """Return by how much the measured signal is later than the simulated one [s].

    The maximum of their cross-correlation within ±0.5 s, between samples by a parabola; of records
    longer than 160 s over sixteen stretches.
    """
    length = round(_STRETCH_S / interval)
    measured, simulated = (stretches(x, length, _STRETCHES) for x in (measured, simulated))
    a, b = measured - measured.mean(), simulated - simulated.mean()
    most = min(len(a) - 1, max(1, round(LONGEST_LAG_S / interval)))
    found = correlate(a, b, mode="full", method="fft")[len(a) - 1 - most : len(a) + most]
    i = int(np.argmax(found))
    shift = 0.0
    if 0 < i < len(found) - 1:
        left, middle, right = found[i - 1 : i + 2]
        bend = left - 2.0 * middle + right
        shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return float((i - most + shift) * interval)


def coherence_of(measured: Array, simulated: Array, rate: float) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the coherence there: 1 where one is a linear filter of the other.

    Welch's method with segments of 4 s, less where the record is short, and 64 of them where it is
    long; shape (f,) each.
    """
    length = min(len(measured) // 4, round(_SEGMENT_S * rate))
    if length < 8:
        return np.zeros(0), np.zeros(0)
    overlap = 0 if len(measured) > _SEGMENTS * length else None
    measured, simulated = (stretches(x, length, _SEGMENTS) for x in (measured, simulated))
    frequencies, found = coherence(measured, simulated, rate, nperseg=length, noverlap=overlap)
    keep = max(1, -(-len(frequencies) // _MOST_FREQUENCIES))
    return frequencies[1::keep], np.nan_to_num(found[1::keep])


def error_bins(error: Array, quantity: Array) -> list[Bin]:
    """Return bias and RMS of the error, (n,), in equal bins of a quantity, (n,), along its bulk.

    The outermost percent on each side is left out, and so is a quantity that does not change. Of
    very many samples every n-th is counted.
    """
    skip = max(1, len(error) // _MOST_SAMPLES)
    error, quantity = error[::skip], quantity[::skip]
    whole = np.isfinite(quantity) & np.isfinite(error)
    error, quantity = error[whole], quantity[whole]
    if len(error) < BINS:
        return []
    low, high = np.quantile(quantity, (0.01, 0.99))
    if not high > low:
        return []
    inside = (quantity > low) & (quantity <= high)
    place = np.minimum(((quantity[inside] - low) * (BINS / (high - low))).astype(int), BINS - 1)
    counts, sums, squares = (
        np.bincount(place, weights, BINS) for weights in (None, error[inside], error[inside] ** 2)
    )
    return [
        Bin(
            float(low + (i + 0.5) * (high - low) / BINS),
            float(sums[i] / counts[i]),
            float(np.sqrt(squares[i] / counts[i])),
            int(counts[i]),
        )
        for i in np.flatnonzero(counts)
    ]


def bins_data(bins: dict[str, list[Bin]]) -> dict[str, Any]:
    """Return bins by quantity as plain data for JSON."""
    return {name: [each._asdict() for each in found] for name, found in bins.items()}
