"""What the cables' lengths say, and what winches and tensions say of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from cspm_ident.signals.timeline import Timeline
from cspm_model.kernels.cable import DAMPING_CONSTANT, DAMPING_SLOPE, OFFSET_LENGTH, RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.trajectory import lengths_along, tensions_along

Array = NDArray[np.float64]

_LENGTHS = 7
_POINTS = 400


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


def elongations(parameters: PlantParameters, tensions: Array, lengths: Array) -> Array:
    """Return the elongation at which cables of such length carry elastic tensions, (k, n) [m].

    Args:
        parameters: of the machine.
        tensions: [N], shape (k, n); what is below zero counts as zero.
        lengths: unstretched [m], shape (k, n).
    """
    out = np.full(tensions.shape, np.nan)
    for i in range(tensions.shape[1]):
        whole = np.isfinite(tensions[:, i]) & np.isfinite(lengths[:, i])
        if not whole.any():
            continue
        pull = np.maximum(tensions[whole, i], 0.0)
        elastic = lengths[whole, i] + parameters.cables[i, OFFSET_LENGTH]
        grid = np.linspace(elastic.min() - 1e-6, elastic.max() + 1e-6, _LENGTHS)
        levels = np.linspace(0.0, pull.max() + 1e-6, _POINTS) ** 2 / (pull.max() + 1e-6)
        table = np.stack([_inverse(parameters, i, length, levels) for length in grid])
        look = RegularGridInterpolator((grid, levels), table)
        out[whole, i] = look(np.column_stack([elastic, pull]))
    return out


def damping_of(parameters: PlantParameters, lengths: Array) -> Array:
    """Return the axial damping at such unstretched lengths, (k, n) [N·s/m], thesis (3-13)."""
    elastic = lengths + parameters.cables[:, OFFSET_LENGTH]
    constant, slope = parameters.cables[:, DAMPING_CONSTANT], parameters.cables[:, DAMPING_SLOPE]
    return np.asarray(np.maximum(constant - slope * elastic, 0.0))


def _inverse(parameters: PlantParameters, i: int, length: float, levels: Array) -> Array:
    """Return the elongations at which cable i of one elastic length carries tension levels."""
    parts = (length, parameters.cables, parameters.tables, i)

    def tensions(at: Array) -> Array:
        out = np.empty(len(at))
        tensions_along(at, *parts, out)
        return out

    reach = 1e-3
    while tensions(np.array([reach]))[0] < levels[-1]:
        reach *= 2.0
    points = np.linspace(0.0, 1.0, 4 * _POINTS) ** 2 * reach
    return np.interp(levels, tensions(points), points)
