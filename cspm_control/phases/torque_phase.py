"""Prescribed torques as a compiled phase, while nothing is wrong."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.torque_profile import profile_torques
from cspm_control.stages.torque_stage import TorqueStage
from cspm_model.kernels.native import integers_at, vector_at
from cspm_model.phase import DONE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import TORQUE_COMMAND

Array = NDArray[np.float64]
Places = NDArray[np.int64]


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    # Integers: the period [ns], and the torques' first column.
    integers, cables, torque = integers_at(places, 0), integers_at(places, 1), vector_at(places, 2)
    offsets, amplitudes = vector_at(places, 3), vector_at(places, 4)
    rates, phases = vector_at(places, 5), vector_at(places, 6)
    seconds = step * integers[0] * 1e-9
    profile_torques(seconds, cables, offsets, amplitudes, rates, phases, torque)
    for i in range(torque.shape[0]):
        row[integers[1] + i] = torque[i]
    return DONE


def torque_phase(stage: TorqueStage, slots: Slots, period_ns: int) -> Phase:
    """Return the stage as a phase of a step of `period_ns` [ns], for torques that begin at 0."""
    integers = np.array([period_ns, slots.first(TORQUE_COMMAND)], dtype=np.int64)
    cables, *numbers = stage.generator.arrays
    return make_phase(_kernel, integers, cables, stage.torque, *numbers, ready=lambda: stage.steady)
