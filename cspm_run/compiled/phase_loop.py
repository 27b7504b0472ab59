"""The kernel that calls phases by their addresses, step by step."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.native import caller_of
from cspm_model.phase import DONE, PHASE

Array = NDArray[np.float64]
Places = NDArray[np.int64]

call_phase = caller_of(PHASE)
# Columns of the timetable: the step at which a phase is due next, steps from one time to the next,
# and the kernel's address, 0 where Python does it.
DUE, DIVIDER, ADDRESS, COLUMNS = range(4)
# The cursor: the step and the phase underway, and what the last kernel returned.
STEP, PHASE_INDEX, CODE = range(3)


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def run_phases(
    cursor: Places,
    begin: int,
    end: int,
    timetable: Places,
    places: Places,
    rows: Array,
    done: NDArray[np.uint8],
) -> None:
    """Call phases from the cursor on until step `end`, or up to one that Python has to do.

    Args:
        cursor: see `STEP`; left at the phase that Python has to do, or at `end`.
        begin: step of the second row.
        end: the step before which to stop.
        timetable: a row per phase, in the order of a step, see `DUE`.
        places: of each phase, (phases, widest).
        rows: the signals, (1 + steps, width); the first row is that of the step before.
        done: which phases were done at which step, (steps, phases).
    """
    step, phase, phases = cursor[STEP], cursor[PHASE_INDEX], timetable.shape[0]
    cursor[CODE] = DONE
    while step < end:
        row = rows[step - begin + 1]
        if phase == 0:
            before = rows[step - begin]
            for i in range(row.shape[0]):
                row[i] = before[i]
        while phase < phases:
            if timetable[phase, DUE] == step:
                address = timetable[phase, ADDRESS]
                code = call_phase(address, step, row, places[phase]) if address != 0 else -1
                if code != DONE:
                    cursor[STEP], cursor[PHASE_INDEX], cursor[CODE] = step, phase, code
                    return
                timetable[phase, DUE] += timetable[phase, DIVIDER]
                done[step - begin, phase] = 1
            phase += 1
        phase = 0
        step += 1
    cursor[STEP], cursor[PHASE_INDEX] = step, 0
