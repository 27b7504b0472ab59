"""The run's statistics as a compiled phase."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.stages.distribution_stage import DistributionStage
from cspm_model.kernels.native import cube_at, integers_at, matrix_at, vector_at
from cspm_model.phase import DONE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import TORQUE_COMMAND
from cspm_run.run_statistics import (
    RunStatistics,
    add_step,
    keep_step,
    torque_limits,
)
from cspm_run.stability.saturation import count_at_limit
from cspm_sim.kernels.phases import SLACK
from cspm_sim.simulator import Simulator
from cspm_sim.simulator_phases import BAR_COORDINATES

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# Integers: columns of the bar's coordinates, of the tensions and of the torques, steps per bin and
# from one that is kept to the next, whether there is a reference, and the last step with a wrench
# that could be met.
TRUE_TENSION = "/truth/cables/tension"
BAR, TENSIONS, TORQUES, BIN_STEPS, KEPT_STEPS, HAS_REFERENCE, FEASIBLE_AT, INTEGERS = range(8)


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    integers, counts, slack = integers_at(places, 0), integers_at(places, 1), integers_at(places, 2)
    infeasible, reference = integers_at(places, 3)[0], vector_at(places, 4)
    error, tensions = vector_at(places, 5), integers[TENSIONS]
    envelope, squares = cube_at(places, 6), vector_at(places, 7)
    kept, limits = matrix_at(places, 8), vector_at(places, 9)
    for d in range(6):
        error[d] = reference[d] - row[integers[BAR] + d] if integers[HAS_REFERENCE] != 0 else 0.0
    n = envelope.shape[2] - 6
    found = envelope[counts[0] // integers[BIN_STEPS]]
    add_step(found, error, row[tensions : tensions + n], squares)
    keep_step(kept, counts[0], integers[KEPT_STEPS], row[tensions : tensions + n])
    counts[0] += 1
    counts[1] += slack[SLACK]
    counts[2] += infeasible
    torques = row[integers[TORQUES] : integers[TORQUES] + len(limits)]
    counts[3] += count_at_limit(integers_at(places, 10), torques, limits)
    if infeasible == 0:
        integers[FEASIBLE_AT] = step
    return DONE


def statistics_phase(
    statistics: RunStatistics,
    simulator: Simulator,
    slots: Slots,
    reference: Array | None,
    distribution: DistributionStage | None,
) -> Phase:
    """Return what counts a step.

    Args:
        statistics: what is counted in.
        simulator: knows whether a cable is slack.
        slots: where the signals are.
        reference: the bar's, as `Motion.at`, which changes in place; None where it has none.
        distribution: knows whether the wrench can be met.
    """
    integers = np.zeros(INTEGERS, dtype=np.int64)
    integers[BAR], integers[TENSIONS] = slots.first(BAR_COORDINATES), slots.first(TRUE_TENSION)
    integers[TORQUES] = slots.first(TORQUE_COMMAND)
    integers[KEPT_STEPS] = statistics.kept_steps
    integers[BIN_STEPS], integers[HAS_REFERENCE] = statistics.bin_steps, reference is not None
    feasible = np.zeros(1, dtype=np.int64)
    return make_phase(
        _kernel,
        integers,
        statistics.counts,
        simulator.counts,
        feasible if distribution is None else distribution.counts,
        np.zeros(6) if reference is None else reference,
        np.zeros(6),
        statistics.envelope,
        statistics.squares,
        statistics.kept,
        torque_limits(simulator.plant.testbed),
        statistics.drives,
    )
