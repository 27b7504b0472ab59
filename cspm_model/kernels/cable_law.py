"""The cables' law along measured elongations."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import elastic_tension, law_scale

Array = NDArray[float64]


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def law_tensions(
    elongations: Array, elastic_lengths: Array, cables: Array, tables: Array, out: Array
) -> None:
    """Write elastic tension [N] and tangent stiffness [N/m] of each cable to `out` (k, n, 2)."""
    for k in range(elongations.shape[0]):
        for i in range(elongations.shape[1]):
            length = elastic_lengths[k, i]
            scale = law_scale(length, cables, i)
            tension, stiffness = elastic_tension(
                elongations[k, i], length, scale, cables, tables, i
            )
            out[k, i, 0] = tension
            out[k, i, 1] = stiffness
