"""How late poses are against the winches that move the bar.

A winch turns with the length of its cable, which the poses of bar and frame give by inverse
kinematics. Both poses are taken to come from one camera: if it is late, every winch is early
against it, by the same time. What the winches differ by is the error.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_checks.lateness import Lateness, lateness
from cspm_checks.machine.kinematics import pose_shift
from cspm_checks.machine.misfit import STATE, Winding
from cspm_checks.machine.poses import BAR
from cspm_checks.series import Log, SensorSeries
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
# Fewer give no error that is worth having.
FEWEST_WINCHES = 3


def comparable(messages: Log, testbed: Testbed) -> bool:
    """Return whether there are a bar's pose and the angles of winches that carry it."""
    state = messages.get(STATE)
    angles = state is not None and "position" in state.topic.parts
    cables = sum(cable.has_cable for cable in testbed.cables)
    return angles and BAR in messages and cables >= FEWEST_WINCHES


def pose_lateness(seen: Winding) -> Lateness | None:
    """Return how late poses are against the winches; None where the signals cannot tell.

    Args:
        seen: what both say of the cables' lengths.
    """
    shift = pose_shift(seen)
    since = shift.seconds if shift else 0.0
    found = []
    for i, angle in enumerate(seen.angles):
        lengths = SensorSeries(seen.bar.time - since, seen.lengths[:, i])
        found.append(lateness(angle, lengths, [], (0,)))
    known = [late for late in found if late is not None]
    if len(known) >= FEWEST_WINCHES:
        late = _of_all(known)
        # Shifts of less than a sample that gain nothing count as none.
        error = max(late.error, 0.5 * late.interval) if shift else late.error
        return late._replace(seconds=late.seconds + since, error=error)
    return Lateness(since, 2.0 * shift.step, 0.0, 0.0, shift.step) if shift else None


def _of_all(winches: list[Lateness]) -> Lateness:
    """Return the mean, as seen from the winches: if they are early, the poses are late."""
    seconds = np.array([-one.seconds for one in winches])
    drift = np.array([-one.drift for one in winches])
    wide = float(student.ppf(0.975, len(winches) - 1)) / np.sqrt(len(winches))
    agreed = abs(drift.mean()) > wide * drift.std(ddof=1) and (drift != 0.0).all()
    return Lateness(
        float(seconds.mean()),
        wide * float(seconds.std(ddof=1)) + 1e-3 * winches[0].interval,
        float(drift.mean()) if agreed else 0.0,
        wide * float(drift.std(ddof=1)),
        winches[0].interval,
    )
