"""What a machine was seen to do: an experiment within it is no new load for the machine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples

Array = NDArray[np.float64]

# Speeds are taken over this time, so that noise of poses does not count as motion.
_SECANT_S = 0.1
# A machine that stood still may move by this much, over a second.
_LEAST = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 0.02])
_USUAL_SHARE = 0.995


class Reach(NamedTuple):
    """How far and how fast something went about its mean, coordinate by coordinate.

    Attributes:
        mean: [m, rad].
        excursion: largest, both ways [m, rad].
        speed: largest [m/s, rad/s].
    """

    mean: Array
    excursion: Array
    speed: Array


def reach_of(samples: Samples) -> Reach:
    """Return the reach of a sensor's readings, single spikes left out."""
    values = samples.values
    low, high = np.quantile(values, [1.0 - _USUAL_SHARE, _USUAL_SHARE], axis=0)
    mean = 0.5 * (low + high)
    step = max(1, round(_SECANT_S / samples.interval)) if samples.interval > 0.0 else 1
    apart = np.abs(values[step:] - values[:-step]) / _SECANT_S
    speed = np.quantile(apart, _USUAL_SHARE, axis=0) if len(apart) else np.zeros(values.shape[1])
    return Reach(mean, 0.5 * (high - low), speed)


def pose_reach(measurement: Measurement, body: str) -> Reach | None:
    """Return the reach of the pose of `bar` or `frame`; None where it was not measured.

    A bar that stood still may be moved a little all the same.
    """
    samples: Samples | None = getattr(measurement, f"{body}_pose")
    if samples is None:
        return None
    found = reach_of(samples)
    if body == "bar":
        excursion = np.maximum(found.excursion, _LEAST)
        return Reach(found.mean, excursion, np.maximum(found.speed, _LEAST))
    return found
