"""How a cable's length and its wrench change with the radius of a swivelling pulley at its exit.

The pulley is that of `kernels.pulley`: the cable enters at the exit along the swivel axis, winds
around by φ and leaves towards the attachment (Pott, Cable-Driven Parallel Robots, 2018, section
4.5). With free length f and unit direction u, dL/dr = φ − sin φ and du/dr = n·(1 − cos φ)/f, where
n is normal to u in the pulley's plane. A cable without pulley has one of radius 0. The cable winds
around less than half of the pulley, so that it leaves on the side of its attachment.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UPWARDS = (0.0, 0.0, -1.0)
"""Axis in winch_frame_ned along which a cable enters a pulley that its file does not have."""

# A cable along the axis has no plane in which a pulley could turn it.
_STRAIGHT = 1e-9


class Span(NamedTuple):
    """One cable along a motion, world axes.

    Attributes:
        directions: unit vectors from the pulley to the attachment, (k, 3).
        arms: from the bar's origin to the attachment, (k, 3) [m].
        lengths: from exit to attachment, (k,) [m].
        axes: unit vectors in which the cable enters the pulley, (k, 3).
        radius: of the pulley [m].
    """

    directions: Array
    arms: Array
    lengths: Array
    axes: Array
    radius: float


def pulley_slopes(span: Span) -> tuple[Array, Array]:
    """Return slopes over the radius: of the length, (k,), and of the wrench per newton, (k, 6).

    Force [1/m] and moment [1] about the bar's origin, in world axes.
    """
    cosine = np.sum(span.directions * span.axes, axis=1)
    beside = span.directions - cosine[:, None] * span.axes
    sine = np.linalg.norm(beside, axis=1)
    wrapped = np.arctan2(sine, cosine)
    outward = beside / np.maximum(sine, _STRAIGHT)[:, None]
    normal = cosine[:, None] * outward - sine[:, None] * span.axes
    free = span.lengths - span.radius * wrapped
    pull = -normal * ((1.0 - cosine) / free)[:, None]
    wrench = np.hstack([pull, np.cross(span.arms, pull)])
    return np.asarray(wrapped - sine), np.asarray(wrench)
