"""A machine's elastic cable law over whole series, and its inverse: thesis (3-7), (3-10)."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_model.kernels.cable import OFFSET_LENGTH
from cspm_model.kernels.cable_law import law_tensions
from cspm_model.kernels.machine import PlantParameters

Array = NDArray[np.float64]

_LENGTHS = 7
_LEVELS = 400
_FIRST_M = 1e-4
_ROUNDS = 12
# Newton's next step would be the square of this.
_EXACT_M = 1e-10


def law_at(parameters: PlantParameters, elongations: Array, elastic_lengths: Array) -> Array:
    """Return elastic tension and tangent stiffness, shape (k, n, 2), thesis (3-7), (3-10)."""
    out = np.empty((*elongations.shape, 2))
    law_tensions(elongations, elastic_lengths, parameters.cables, parameters.tables, out)
    return out


def elongation_at(
    parameters: PlantParameters,
    tensions: Array,
    elastic_lengths: Array,
    near: Array | None = None,
) -> Array:
    """Return the elongation at which cables carry elastic tensions, (k, n) [m]; 0 where slack.

    By Newton's method, from what is `near` or from a chord; the law is smooth and rises (3-7).
    """
    wanted = np.maximum(tensions, 0.0)
    if near is None or np.any((near <= 0.0) & (wanted > 0.0)):
        law = law_at(parameters, np.full(tensions.shape, _FIRST_M), elastic_lengths)
        near = _FIRST_M * wanted / law[:, :, 0]
    found = np.where(wanted > 0.0, near, 0.0)
    for _ in range(_ROUNDS):
        law = law_at(parameters, found, elastic_lengths)
        slope = np.where(law[:, :, 1] > 0.0, law[:, :, 1], np.inf)
        before, found = found, np.maximum(found + (wanted - law[:, :, 0]) / slope, 0.0)
        if np.max(np.abs(found - before), initial=0.0) < _EXACT_M:
            break
    return found


def tabulated_elongation(parameters: PlantParameters, tensions: Array, lengths: Array) -> Array:
    """Return what `elongation_at` returns, by interpolation in a table, NaN where either is NaN.

    For many samples of which some are missing: the law is evaluated at 7 lengths only. Against the
    exact inverse the error is some 1e-4 of the largest elongation.

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
        levels = np.linspace(0.0, pull.max() + 1e-6, _LEVELS) ** 2 / (pull.max() + 1e-6)
        table = np.stack([_inverse(parameters, i, length, levels) for length in grid])
        look = scipy.interpolate.RegularGridInterpolator((grid, levels), table)
        out[whole, i] = look(np.column_stack([elastic, pull]))
    return out


def _inverse(parameters: PlantParameters, i: int, length: float, levels: Array) -> Array:
    """Return the elongations at which cable i of one elastic length carries tension levels."""
    cable, table = parameters.cables[i : i + 1], parameters.tables[i : i + 1]

    def tensions(at: Array) -> Array:
        law = np.empty((len(at), 1, 2))
        law_tensions(at[:, None], np.full((len(at), 1), length), cable, table, law)
        return law[:, 0, 0]

    reach = 1e-3
    while tensions(np.array([reach]))[0] < levels[-1]:
        reach *= 2.0
    points = np.linspace(0.0, 1.0, 4 * _LEVELS) ** 2 * reach
    return np.interp(levels, tensions(points), points)
