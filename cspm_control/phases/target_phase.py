"""The target tracker as a compiled phase."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.stages.target_stage import TargetStage
from cspm_control.waves.target_filter import follow_target
from cspm_model.kernels.native import integers_at, matrix_at, vector_at
from cspm_model.kernels.rows import reference_row
from cspm_model.phase import DONE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import BAR_REFERENCE, TARGET_POSE

Array = NDArray[np.float64]
Places = NDArray[np.int64]


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    # Integers: columns of the measured pose and of the reference.
    integers, values, offset = integers_at(places, 0), vector_at(places, 1), vector_at(places, 2)
    motion, gains = matrix_at(places, 3), vector_at(places, 4)
    period, last, counts = vector_at(places, 5), vector_at(places, 6), integers_at(places, 7)
    pose, out = integers[0], integers[1]
    follow_target(row[pose : pose + 7], gains, period[0], last, counts, motion)
    for order in range(3):
        for d in range(6):
            values[6 * order + d] = motion[order, d] + (offset[d] if order == 0 else 0.0)
    reference_row(values, row[out : out + 19])
    return DONE


def target_phase(stage: TargetStage, slots: Slots) -> Phase:
    """Return the stage as a phase."""
    found = stage.filter
    columns = np.array([slots.first(TARGET_POSE), slots.first(BAR_REFERENCE)], dtype=np.int64)
    own = found.motion, found.gains, found.period, found.last, found.counts
    return make_phase(_kernel, columns, stage.values, stage.offset, *own)
