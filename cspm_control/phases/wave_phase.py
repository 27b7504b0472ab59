"""The wave trajectory as a compiled phase."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.stages.wave_stage import WaveStage
from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.native import fixed_matrix_at, integers_at, vector_at
from cspm_model.kernels.rows import reference_row
from cspm_model.phase import DONE, Phase, Slots, make_phase

Array = NDArray[np.float64]
Places = NDArray[np.int64]

REFERENCE = 19


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    # Integers: the period [ns], how many bodies, then per body its column and if it is periodic.
    integers, spacings = integers_at(places, 0), vector_at(places, 1)
    time = step * integers[0] * 1e-9
    for i in range(integers[1]):
        column, values = integers[2 + 2 * i], vector_at(places, 3 + 2 * i)
        knots, periodic = fixed_matrix_at(places, 2 + 2 * i), integers[3 + 2 * i] != 0
        evaluate_motion(time, knots, spacings[i], periodic, values)
        reference_row(values, row[column : column + REFERENCE])
    return DONE


def wave_phase(stage: WaveStage, slots: Slots, period_ns: int) -> Phase:
    """Return the stage as a phase of a step of `period_ns` [ns]."""
    integers, arrays = [period_ns, len(stage.trajectories)], []
    for topic, trajectory in stage.trajectories.items():
        motion = trajectory.motion
        integers += [slots.first(topic), motion.periodic]
        arrays += [motion.knots, trajectory.values]
    spacings = [each.motion.spacing for each in stage.trajectories.values()]
    numbers = np.array(integers, dtype=np.int64)
    return make_phase(_kernel, numbers, np.array(spacings), *arrays)
