"""Lengths, length rates and axial damping of cables along a measured timeline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.timeline import Timeline
from cspm_model.kernels.cable import DAMPING_CONSTANT, DAMPING_SLOPE, OFFSET_LENGTH, RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.trajectory import lengths_along

Array = NDArray[np.float64]


class CableMotion(NamedTuple):
    """Cables along a timeline; all of shape (k, n), NaN where a pose or angle is missing.

    Attributes:
        lengths: stretched, from the poses [m].
        bar_rates: what the bar's motion adds to the length per second [m/s].
        frame_rates: what the winch frame's motion adds [m/s].
        left: share of the first step's unstretched length that is not wound in, from the angles.
    """

    lengths: Array
    bar_rates: Array
    frame_rates: Array
    left: Array


def cable_motion(timeline: Timeline, parameters: PlantParameters) -> CableMotion:
    """Return what poses and angles say of the cables; l̇0 as in thesis (2-16..2-18)."""
    steps, n = len(timeline.times), len(parameters.cables)
    lengths, bar_rates, frame_rates = (np.empty((steps, n)) for _ in range(3))
    lengths_along(
        parameters.cables,
        np.ascontiguousarray(timeline.bar_poses),
        timeline.frame_poses,
        timeline.bar_twists,
        timeline.frame_twists,
        lengths,
        bar_rates,
        frame_rates,
    )
    angles = np.zeros((steps, n)) if timeline.angles is None else timeline.angles
    radius = parameters.cables[:, RADIUS]
    turned = np.nan_to_num(np.diff(angles, axis=0)) * radius
    middle = 0.5 * (lengths[1:] + lengths[:-1])
    # The winch winds stretched cable, thesis (2-16..2-18): l̇0/l0 = −r·q̇/l.
    shrink = np.vstack([np.zeros(n), np.cumsum(np.nan_to_num(turned / middle), axis=0)])
    return CableMotion(lengths, bar_rates, frame_rates, np.exp(-shrink))


def damping_of(parameters: PlantParameters, lengths: Array) -> Array:
    """Return the axial damping at such unstretched lengths, (k, n) [N·s/m], thesis (3-13)."""
    elastic = lengths + parameters.cables[:, OFFSET_LENGTH]
    constant, slope = parameters.cables[:, DAMPING_CONSTANT], parameters.cables[:, DAMPING_SLOPE]
    return np.asarray(np.maximum(constant - slope * elastic, 0.0))
