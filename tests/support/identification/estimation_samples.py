"""Data with known parameters and coloured noise, made without the code under test."""

import numpy as np
from scipy.signal import lfilter

from cspm_ident.estimation import Parameter, Record

TRUTH = np.array([2.0, -0.5, 0.3])
NAMES = ("gain", "slope", "level")


def parameters(**changes):
    """Three parameters without bounds; keywords change one by its name."""
    return tuple(
        Parameter(**{"name": name, "unit": "1", "scale": 1.0, **changes.get(name, {})})
        for name in NAMES
    )


def first_order(rng, count, decay, deviation):
    """A process with e-folding `decay` per sample and this standard deviation."""
    draws = rng.standard_normal(count) * np.sqrt(1.0 - decay**2)
    draws[0] = rng.standard_normal()
    return deviation * lfilter([1.0], [1.0, -decay], draws)


def columns(time):
    """Three regressors that are far from equal."""
    return np.stack([np.sin(0.05 * time), np.cos(0.11 * time), np.ones_like(time)], axis=1)


def records(rng, counts=(1500, 700), decay=0.9, deviation=0.2, truth=TRUTH):
    """Records of y = Φ·truth + noise."""
    found = []
    for count in counts:
        regressors = columns(np.arange(count) + rng.uniform(0.0, 500.0))
        noise = first_order(rng, count, decay, deviation)
        found.append(Record(regressors @ truth + noise, regressors))
    return found
