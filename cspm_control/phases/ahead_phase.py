"""What goes before the force controllers, as compiled phases: load cell biases and feedforward.

The phase of the force controllers calls them at its own steps, by address.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.load_cell_bias import BIAS, LARGEST, learn_bias
from cspm_control.feedforward.friction_feedforward import friction_torque
from cspm_control.feedforward.winch_feedforward import winch_torque
from cspm_control.stages.force_stage import STILL, ForceStage
from cspm_model.kernels.native import (
    columns_at,
    cube_at,
    flags_at,
    integers_at,
    matrix_at,
    vector_at,
)
from cspm_model.phase import DONE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import BAR_REFERENCE, FRAME_REFERENCE, TENSION, WINCH_STATE

Array = NDArray[np.float64]
Places = NDArray[np.int64]
WIDTH = len(STILL)

# Integers of the feedforwards: columns of the references in the row (frame −1: it stands still),
# and whether the torque is added to what is there.
BAR, FRAME, ADDS = range(3)


@njit(cache=True, error_model="numpy")
def _frame_row(row: Array, first: int, still: Array) -> Array:
    return row[first : first + WIDTH] if first >= 0 else still


@njit(cache=True, error_model="numpy")
def _friction(step: int, row: Array, places: Places) -> int:
    integers, still, wanted = integers_at(places, 0), vector_at(places, 1), vector_at(places, 2)
    ahead, cables, friction = vector_at(places, 3), columns_at(places, 4), matrix_at(places, 5)
    bar = row[integers[BAR] : integers[BAR] + WIDTH]
    frame = _frame_row(row, integers[FRAME], still)
    friction_torque(bar, frame, wanted, cables, friction, vector_at(places, 6)[0], ahead)
    return DONE


@njit(cache=True, error_model="numpy")
def _winch(step: int, row: Array, places: Places) -> int:
    integers, still, wanted = integers_at(places, 0), vector_at(places, 1), vector_at(places, 2)
    ahead, cables, tables = vector_at(places, 3), columns_at(places, 4), cube_at(places, 5)
    numbers, memory, first = vector_at(places, 6), matrix_at(places, 7), vector_at(places, 8)
    bar = row[integers[BAR] : integers[BAR] + WIDTH]
    frame = _frame_row(row, integers[FRAME], still)
    torque = np.empty(ahead.shape[0])
    winch_torque(bar, frame, wanted, cables, tables, numbers, memory, first, torque)
    for i in range(torque.shape[0]):
        ahead[i] = ahead[i] + torque[i] if integers[ADDS] != 0 else torque[i]
    return DONE


@njit(cache=True, error_model="numpy")
def _bias(step: int, row: Array, places: Places) -> int:
    # Integers: columns of tensions and winches.
    columns, corrected, torques = integers_at(places, 0), vector_at(places, 1), vector_at(places, 2)
    winches, numbers, started = matrix_at(places, 3), vector_at(places, 4), flags_at(places, 5)
    last, smoothed, means = matrix_at(places, 6), matrix_at(places, 7), matrix_at(places, 8)
    n, first = corrected.shape[0], columns[1]
    measured, speeds = row[columns[0] : columns[0] + n], row[first + n : first + 2 * n]
    of_filters = numbers, started, last, smoothed, means, cube_at(places, 9)
    learn_bias(measured, speeds, torques, winches, *of_filters)
    for i in range(n):
        believed = min(numbers[LARGEST], max(-numbers[LARGEST], means[i, BIAS]))
        corrected[i] = measured[i] - believed
    return DONE


def feedforward_phases(stage: ForceStage, slots: Slots, ahead: Array) -> list[Phase]:
    """Return what computes the torques ahead (n,) [N·m], in the stage's order."""
    found = []
    columns = [slots.first(BAR_REFERENCE), slots.first(FRAME_REFERENCE)]
    common = STILL, stage.wanted, ahead
    if (friction := stage.friction) is not None:
        integers = np.array([*columns, 0], dtype=np.int64)
        arrays = friction.cables, friction.friction, np.array([friction.smooth_below])
        found.append(make_phase(_friction, integers, *common, *arrays))
    if (winch := stage.winch) is not None:
        integers = np.array([*columns, bool(found)], dtype=np.int64)
        machine, state = (winch.cables, winch.tables), (winch.numbers, winch.memory, winch.first)
        found.append(make_phase(_winch, integers, *common, *machine, *state))
    return found


def bias_phase(stage: ForceStage, slots: Slots, corrected: Array) -> Phase | None:
    """Return what corrects the tensions (n,) [N] by their load cells' biases; None: nothing."""
    if (bias := stage.bias) is None:
        return None
    columns = np.array([slots.first(TENSION), slots.first(WINCH_STATE)], dtype=np.int64)
    filters = bias.winches, bias.numbers, bias.started, bias.last, bias.smoothed
    return make_phase(_bias, columns, corrected, stage.torque, *filters, bias.means, bias.spreads)
