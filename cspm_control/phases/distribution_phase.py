"""The tension distribution as a compiled phase."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.allocation.preferred_tension import AT_LIMIT
from cspm_control.allocation.tension_distribution import (
    DISTRIBUTE,
    RESIDUAL_TOLERANCE,
    TensionDistribution,
    distribute,
)
from cspm_control.stages.distribution_stage import (
    INFEASIBLE,
    INFEASIBLE_STEPS,
    SATURATED_STEPS,
    STEPS,
    DistributionStage,
)
from cspm_model.kernels.native import (
    address_of,
    caller_of,
    columns_at,
    flags_at,
    integers_at,
    matrix_at,
    vector_at,
)
from cspm_model.phase import DONE, LEAVE, Phase, Slots, make_phase
from cspm_msgs_py.schedule import (
    BAR_POSE,
    DISTRIBUTION_INTERNALS,
    FRAME_POSE,
    TENSION,
    TENSION_COMMAND,
    WRENCH,
)

Array = NDArray[np.float64]
Places = NDArray[np.int64]

call_distribute = caller_of(DISTRIBUTE)
# Integers: addresses of `distribute` and the method, columns in the row (-1: none), how many cables
# there were, how many more may be lost, and after how many steps one is.
DISTRIBUTE_AT, METHOD_AT, WANTED, BAR, FRAME, MEASURED, OUT, INTERNALS, WHOLE = range(9)
MAY_BE_LOST, LOST_AFTER, INTEGERS = 9, 10, 11
UNMOVED = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


@njit(cache=True, error_model="numpy", inline="always")
def pose_in(row: Array, first: int, still: Array) -> Array:
    """Return a pose row (7,) of the row, `still` where there is none."""
    return row[first : first + 7] if first >= 0 else still


@njit(cache=True, error_model="numpy", _nrt=False)
def _kernel(step: int, row: Array, places: Places) -> int:
    integers, counts, kept = integers_at(places, 0), integers_at(places, 1), integers_at(places, 2)
    limits, tensions, residual = matrix_at(places, 7), matrix_at(places, 9), vector_at(places, 10)
    lost, bounds = integers_at(places, 12), vector_at(places, 13)
    if not _watch(row, integers, lost, flags_at(places, 14), bounds[0]):
        return LEAVE
    wanted, bar = integers[WANTED], integers[BAR]
    saturated = call_distribute(
        integers[DISTRIBUTE_AT],
        integers[METHOD_AT],
        row[wanted : wanted + 6],
        row[bar : bar + 7],
        pose_in(row, integers[FRAME], vector_at(places, 11)),
        columns_at(places, 3),
        integers_at(places, 4),
        matrix_at(places, 5),
        vector_at(places, 6),
        limits,
        vector_at(places, 8),
        vector_at(places, 15),
        tensions,
        residual,
    )
    if saturated < 0:
        return LEAVE
    counts[INFEASIBLE] = 0 if residual[0] <= RESIDUAL_TOLERANCE else 1
    counts[STEPS] += 1
    counts[INFEASIBLE_STEPS] += counts[INFEASIBLE]
    counts[SATURATED_STEPS] += saturated > 0
    bounds[1] = max(bounds[1], residual[0])
    _send(row, integers, kept, limits, tensions)
    return DONE


@njit(cache=True, error_model="numpy", inline="always")
def _watch(row: Array, integers: Places, counts: Places, lost: Array, below: float) -> bool:
    """Count how long cables carry nothing; False, with nothing counted, where one is lost."""
    first, n = integers[MEASURED], integers[WHOLE]
    if first < 0:
        return True
    for i in range(n):
        known = lost[i] or integers[MAY_BE_LOST] <= 0
        if not known and row[first + i] < below and counts[i] + 1 >= integers[LOST_AFTER]:
            return False
    for i in range(n):
        counts[i] = counts[i] + 1 if row[first + i] < below else 0
    return True


@njit(cache=True, error_model="numpy", inline="always")
def _send(row: Array, integers: Places, kept: Places, limits: Array, tensions: Array) -> None:
    out, internals, whole = integers[OUT], integers[INTERNALS], integers[WHOLE]
    for i in range(whole):
        row[out + i] = 0.0
    for i in range(kept.shape[0]):
        row[out + kept[i]] = tensions[1, i]
    if internals >= 0:
        for i in range(2 * whole):
            row[internals + i] = 0.0
        for i in range(kept.shape[0]):
            high = 1.0 if tensions[1, i] >= limits[i, 1] - AT_LIMIT else 0.0
            low = 1.0 if tensions[1, i] <= limits[i, 0] + AT_LIMIT else 0.0
            row[internals + kept[i]] = tensions[0, i]
            row[internals + whole + kept[i]] = high - low


def distribution_arrays(found: TensionDistribution) -> tuple[NDArray[Any], ...]:
    """Return what `distribute` works on, in its order, from the cables on."""
    own = (found.cables, found.axes, found.structure, found.wanted, found.limits)
    return (*own, found.weights, found.tensions, found.residual)


def distribution_phase(stage: DistributionStage, slots: Slots) -> Phase | None:
    """Return the stage as a phase, None where Python computes the tensions."""
    found, lost, n = stage.distribution, stage.lost_cables, len(stage.names)
    if found.address is None:
        return None
    integers = np.full(INTEGERS, -1, dtype=np.int64)
    integers[DISTRIBUTE_AT], integers[METHOD_AT] = address_of(distribute, DISTRIBUTE), found.address
    integers[WANTED], integers[BAR] = slots.first(WRENCH), slots.first(BAR_POSE)
    integers[FRAME], integers[OUT] = slots.first(FRAME_POSE), slots.first(TENSION_COMMAND)
    integers[WHOLE] = n
    if stage.internals:
        integers[INTERNALS] = slots.first(DISTRIBUTION_INTERNALS)
    counts, flags = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    if lost is not None and TENSION in slots:
        integers[MEASURED], integers[LOST_AFTER] = slots.first(TENSION), lost.steps
        integers[MAY_BE_LOST] = lost.most - int(lost.lost.sum())
        counts, flags = lost.counts, lost.lost
        stage.bounds[0] = lost.below
    kept = np.flatnonzero(~flags)
    still = np.array(UNMOVED)
    arrays = distribution_arrays(found)
    watched = (still, counts, stage.bounds, flags, found.memory)
    return make_phase(_kernel, integers, stage.counts, kept, *arrays, *watched)
