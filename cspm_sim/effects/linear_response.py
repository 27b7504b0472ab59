"""The response of a linear system to a measured signal, for regressors with memory."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from cspm_sim.effects.effect import Array


def linear_response(
    numerator: Sequence[float], denominator: Sequence[float], time: Array, driven: Array
) -> Array:
    """Return the response from rest to inputs joined by straight lines, shape of `driven`.

    Args:
        numerator: of the transfer function, falling powers of s.
        denominator: likewise.
        time: equal steps, shape (samples,) [s].
        driven: one input per column, shape (samples, inputs).
    """
    from scipy.signal import lfilter

    step = float(time[-1] - time[0]) / max(1, len(time) - 1)
    ramps, jump, poles = _sampled(tuple(numerator), tuple(denominator), step)
    # From rest: what is there from the first sample on is a step, not the end of a ramp to it.
    constant = np.broadcast_to(driven[0], driven.shape)
    return np.asarray(
        lfilter(ramps, poles, driven - constant, axis=0) + lfilter(jump, poles, constant, axis=0)
    )


@lru_cache(maxsize=256)
def _sampled(
    numerator: tuple[float, ...], denominator: tuple[float, ...], step: float
) -> tuple[Array, Array, Array]:
    """Return numerators for inputs of straight lines and of steps, and their denominator."""
    from scipy.signal import cont2discrete

    system = (list(numerator), list(denominator))
    ramps, poles, _ = cont2discrete(system, step, method="foh")
    jump, _, _ = cont2discrete(system, step, method="zoh")
    return np.ravel(ramps), np.ravel(jump), poles
