"""Jumps of an encoder's reading: spikes, resets, and counters that roll over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from cspm_ident.signals.samples import HOLE, Samples

Array = NDArray[np.float64]

# A step is a jump where it is this many times as fast as nearly all steps of the recording. Of a
# sine, 95 % of the steps are slower than 0.997 of its largest speed; encoders jump by far more.
_FASTER = 5.0
# Nearly all steps: a counter that rolls over every 20 samples must not raise the limit.
_MOST = 95.0
# Steps beside a jump that tell the speed there; a spike is two jumps among them.
_BESIDE = 9
# A motor that starts moves on: beside a jump the shaft is this much slower.
_ABRUPT = 10.0


def jumps(samples: Samples) -> NDArray[np.intp]:
    """Return after which samples the reading of a single encoder jumps, increasing, (k,).

    A jump is a step much faster than nearly all others, and much faster than those beside it: no
    sampled motion has one. A spike is two jumps.

    Args:
        samples: angle at the motor shaft [rad], one column.
    """
    if len(samples.times) < _BESIDE:
        return np.zeros(0, dtype=np.intp)
    # Stamps that scatter make short intervals: these hold no speed.
    lasting = np.maximum(np.diff(samples.times), samples.interval)
    speeds = np.abs(np.diff(samples.values[:, 0])) / lasting
    beside = median_filter(speeds, size=_BESIDE, mode="nearest")
    usual = np.percentile(speeds, _MOST)
    return np.flatnonzero((speeds > _FASTER * usual) & (speeds > _ABRUPT * beside))


def without_jumps(samples: Samples) -> Samples:
    """Return the samples of a single encoder with a hole at each jump, which no window spans."""
    found = jumps(samples)
    if not len(found):
        return samples
    keep = np.ones(len(samples.times), dtype=np.bool_)
    beside = int(np.ceil(HOLE / 2.0))
    for index in found:
        keep[max(0, index + 1 - beside) : index + 1 + beside] = False
    return Samples(samples.times[keep], samples.values[keep])
