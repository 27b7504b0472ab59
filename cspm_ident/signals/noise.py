"""How much a sensor's samples scatter when nothing happens."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import filtered
from cspm_model.robust_statistics import difference_noise

Array = NDArray[np.float64]

_REST_S = 1.0
_QUIET = 4.5
_FEWEST = 16


def noise_above_band(samples: Samples) -> Array:
    """Return the standard deviation of each column's noise, from what lies above its band.

    The share of white noise that lies within the band is added back.
    """
    smoothed, band = filtered(samples)
    if not np.isfinite(band):
        # A sensor whose band is full: fourth differences leave little else than noise.
        few = len(samples.times) < _FEWEST
        return np.zeros(samples.values.shape[1]) if few else difference_noise(samples.values, 4)
    seen = 1.0 - min(0.9, 2.0 * band / samples.rate)
    return np.asarray((samples.values - smoothed).std(axis=0) / np.sqrt(seen))


def rest_of(measurement: Measurement) -> tuple[float, float] | None:
    """Return begin and end [s] of the longest time in which no sensor shows motion, if any.

    Poses and angles must stay within their noise for at least a second.
    """
    moving: list[tuple[float, float]] = []
    for samples in (measurement.frame_pose, measurement.bar_pose, measurement.angle):
        if samples is not None:
            moving += _moving(samples)
    if not moving:
        return None
    end = measurement.duration
    edges = sorted([*moving, (end, end)])
    best, reached = (0.0, 0.0), 0.0
    for start, stop in edges:
        if start - reached > best[1] - best[0]:
            best = (reached, start)
        reached = max(reached, stop)
    return best if best[1] - best[0] >= _REST_S else None


def _moving(samples: Samples) -> list[tuple[float, float]]:
    """Return the blocks of a quarter of a second in which a sensor moves, as times [s]."""
    block = max(4, round(0.25 * samples.rate))
    count = len(samples.times) // block
    noise = noise_above_band(samples)
    values = samples.values[: count * block].reshape(count, block, -1)
    means = values.mean(axis=1)
    change = np.abs(np.diff(means, axis=0))
    limit = _QUIET * noise * np.sqrt(2.0 / block) + 1e-12
    spread = values.std(axis=1) > 1.5 * noise + 1e-12
    moved = spread.any(axis=1)
    moved[1:] |= (change > limit).any(axis=1)
    moved[:-1] |= (change > limit).any(axis=1)
    times = samples.times[: count * block].reshape(count, block)
    return [(float(times[i, 0]), float(times[i, -1])) for i in np.flatnonzero(moved)]


def noise_at_rest(samples: Samples, rest: tuple[float, float]) -> Array:
    """Return the standard deviation of each column while nothing moves."""
    return np.asarray(samples.within(*rest).values.std(axis=0))


def noise_between(samples: Samples, repeat: Samples) -> Array:
    """Return each column's noise from a repeat of the same experiment, sample by sample."""
    count = min(len(samples.times), len(repeat.times))
    apart = samples.values[:count] - repeat.values[:count]
    return np.asarray(apart.std(axis=0) / np.sqrt(2.0))


def with_more_noise(measurement: Measurement, noise: dict[str, Array], seed: int) -> Measurement:
    """Return the measurement with as much noise again on its inputs, by attribute name."""
    generator = np.random.default_rng(seed)
    changed: dict[str, Any] = {}
    for name, deviation in noise.items():
        samples: Samples = getattr(measurement, name)
        scatter = generator.standard_normal(samples.values.shape) * deviation
        changed[name] = Samples(samples.times, samples.values + scatter)
    return replace(measurement, **changed)
