"""The machine as flat arrays, and where its bar and winch frame are: what every kernel reads."""

from typing import NamedTuple

from numba import njit
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.rotation import (
    Placement,
    euler_rate_to_world_rate,
    rotate,
    rotation_from_euler,
)

Array = NDArray[float64]

BAR_STATES = 12
# Columns of an effect's row in `PlantParameters.effects`.
EFFECT_COLUMNS = 7


class PlantParameters(NamedTuple):
    """Everything constant, as flat arrays. `n` cables, `m` effects on single elements.

    Attributes:
        bar: bar parameters and gravity, empty without a bar; see `kernels.bar`.
        cables: shape (n, CABLE_COLUMNS), cables with their winches; see `kernels.cable`. In column
            order in memory, so that a processor takes several cables at a time.
        tables: shape (n, points, 2): tension and its slope along the stiffness law.
        effects: shape (m, ROW_COLUMNS): hook, element (cable index, 0 for bar and winch frame),
            kernel address, first state, number of states, and the addresses of what computes
            effects on cables and on the bar; see `cspm_sim.kernels.hooks`. Rows
            ascend by hook and within a hook by element: kernels walk them once, without search.
        effect_parameters: shape (m, widest).
    """

    bar: Array
    cables: Array
    tables: Array
    effects: NDArray[int64]
    effect_parameters: Array


@njit(cache=True, error_model="numpy", inline="always")
def frame_placement(frame: Array) -> Placement:
    """Return the winch frame's position, rotation, velocity and angular velocity."""
    rate = euler_rate_to_world_rate(frame[4], frame[5], frame[9], frame[10], frame[11])
    return (
        (frame[0], frame[1], frame[2]),
        rotation_from_euler(frame[3], frame[4], frame[5]),
        (frame[6], frame[7], frame[8]),
        rate,
    )


@njit(cache=True, error_model="numpy", inline="always")
def bar_placement(state: Array, has_bar: bool) -> Placement:
    """Return the bar's placement; without a bar that of the world, where its cables end."""
    if not has_bar:
        zero = (0.0, 0.0, 0.0)
        return zero, rotation_from_euler(0.0, 0.0, 0.0), zero, zero
    rotation = rotation_from_euler(state[3], state[4], state[5])
    return (
        (state[0], state[1], state[2]),
        rotation,
        (state[6], state[7], state[8]),
        rotate(rotation, state[9], state[10], state[11]),
    )
