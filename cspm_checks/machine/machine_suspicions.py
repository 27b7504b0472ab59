"""What contradicts the machine: encoders, poses and load cells against each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.lateness import LONGEST_S
from cspm_checks.machine.cell_drift import cell_drift
from cspm_checks.machine.cell_order import STATE, TENSION, cell_suspicions
from cspm_checks.machine.coarse_lateness import coarse_shift
from cspm_checks.machine.kinematics import kinematic_suspicions
from cspm_checks.machine.misfit import Winding
from cspm_checks.machine.poses import bodies
from cspm_checks.relations import late_suspicion
from cspm_checks.series import Log, SensorSeries, series_of
from cspm_checks.suspicion import Suspicion
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


def machine_suspicions(
    log: Log, testbed: Testbed, seen: Winding | None, origin_ns: int
) -> list[Suspicion]:
    """Return what contradicts the machine.

    Args:
        log: the topics.
        testbed: the machine.
        seen: what poses and encoders say of its cables, where both were recorded.
        origin_ns: the instant from which times count [ns].
    """
    found = [] if seen is None else kinematic_suspicions(seen)
    if late := _late_cells(log, testbed, origin_ns):
        return found + late
    found += (exchanged := cell_suspicions(log, testbed, origin_ns))
    # What contradicts already leaves no balance.
    return found if found or exchanged else _drift(log, testbed, origin_ns)


def _late_cells(log: Log, testbed: Testbed, origin_ns: int) -> list[Suspicion]:
    """Return by how much all load cells are late against the torques, where that is much."""
    state, cells = log.get(STATE), log.get(TENSION)
    if state is None or cells is None or "effort" not in state.topic.parts:
        return []
    names = [
        each.name
        for each in testbed.cables
        if each.has_cable and f"effort/{each.name}" in cells.measured
    ]
    torques = [series_of(state, f"effort/{name}", origin_ns) for name in names]
    pulls = [series_of(cells, f"effort/{name}", origin_ns) for name in names]
    if not names or any(len(one.time) < 3 for one in (*torques, *pulls)):
        return []
    radii = {each.name: each.wound_radius for each in testbed.cables}
    mine, ours = _table(pulls), _table(torques)
    scale = np.array([radii[name] for name in names])
    found = coarse_shift(pulls[0].time, mine * scale, torques[0].time, ours)
    if found is None or abs(found.seconds) <= LONGEST_S:
        return []
    which = "late" if found.seconds > 0 else "early"
    text = f"all load cells are {abs(found.seconds):.4g} ± {found.step:.2g} s {which} against the"
    text += f" torques, with which they then correlate by {found.correlation:.2f}"
    numbers = {"seconds": found.seconds, "error": found.step}
    return [late_suspicion(TENSION, text, numbers)]


def _table(series: list[SensorSeries]) -> Array:
    """Return the values of channels at the instants of the first, a column each."""
    time = series[0].time
    return np.stack([np.interp(time, one.time, one.values) for one in series], axis=1)


def _drift(log: Log, testbed: Testbed, origin_ns: int) -> list[Suspicion]:
    """Return which load cell drifts against the others."""
    cells, moving = log.get(TENSION), bodies(log, testbed, origin_ns)
    fields = [f"effort/{name}" for name in testbed.cable_names]
    if cells is None or moving is None or not set(fields) <= set(cells.measured):
        return []
    tensions = [series_of(cells, field, origin_ns) for field in fields]
    if any(len(one.time) < 3 for one in tensions):
        return []
    found = cell_drift(testbed, *moving, tensions)
    if found is None:
        return []
    text = (
        f"drifts by {found.rate:.3g} ± {found.error:.2g} N/s against the other load cells, by the"
    )
    text += f" balance of the bar: {found.change:.3g} N over the recording"
    return [Suspicion(f"{TENSION} {fields[found.cell]}", "drift", text, found._asdict())]
