"""The bar's reference where it is moved by hand at times, and tracks its target at others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.realisation import checked_count, envelope
from cspm_model.motion import Motion
from cspm_msgs_py.scenario_keys.operation import OPERATION_GRID, Manual, Operation

Array = NDArray[np.float64]


def operated(motion: Motion, operation: Sequence[Operation], duration: float) -> Motion:
    """Return the reference of a bar that is operated by a timetable.

    At each switch the reference passes over from what it would go on doing to what the new mode
    does, by the minimum-jerk profile: its velocity where it is moved by hand, its position where
    it tracks. Position, velocity and acceleration are continuous. Before the first switch it
    tracks.

    Args:
        motion: what tracking follows, target and offset.
        operation: the timetable, in order.
        duration: of the run [s].

    Raises:
        InputError: the run needs more knots than can be stored.
    """
    count = checked_count(int(np.ceil(duration / OPERATION_GRID)) + 1)
    times = np.arange(count) * OPERATION_GRID
    tracking = np.array([motion.at(float(t)) for t in times]).reshape(count, 3, 6)
    found = tracking.copy()
    for entry in operation:
        first = round(entry.at / OPERATION_GRID)
        elapsed = times[first:] - times[first]
        old = found[first:]
        if isinstance(entry, Manual):
            found[first:] = at_rate(old, np.array(entry.rate), elapsed, entry.blend)
        else:
            found[first:] = passed_over(old, tracking[first:], elapsed, entry.blend)
    return Motion(found.reshape(count, 18), OPERATION_GRID)


def at_rate(old: Array, rate: Array, elapsed: Array, blend: float) -> Array:
    """Return a motion (n, 3, 6) whose velocity leaves that of `old` for `rate` (6,).

    It goes on from where `old` is at first; other arguments as `passed_over`. Positions are the
    integral of the velocity, by the trapezoidal rule with its end correction.
    """
    if blend == 0.0:
        done, change = np.ones((len(elapsed), 1)), np.zeros((len(elapsed), 1))
    else:
        done, change = (each[:, None] for each in envelope(elapsed, blend)[:2])
    found = np.zeros_like(old)
    found[:, 1] = old[:, 1] + done * (rate - old[:, 1])
    found[:, 2] = (1.0 - done) * old[:, 2] + change * (rate - old[:, 1])
    speeds, changes = found[:, 1], found[:, 2]
    steps = 0.5 * OPERATION_GRID * (speeds[1:] + speeds[:-1])
    steps += OPERATION_GRID**2 / 12.0 * (changes[:-1] - changes[1:])
    found[0, 0] = old[0, 0]
    found[1:, 0] = old[0, 0] + np.cumsum(steps, axis=0)
    return found


def passed_over(old: Array, new: Array, elapsed: Array, blend: float) -> Array:
    """Return a motion (n, 3, 6) that leaves `old` for `new` within `blend` [s].

    Both are values, first and second derivatives at n instants `elapsed` [s] after the switch.
    """
    if blend == 0.0:
        return new
    done, rate, acceleration = (each[:, None] for each in envelope(elapsed, blend))
    place, speed, change = np.moveaxis(new - old, 1, 0)
    added = [
        done * place,
        done * speed + rate * place,
        done * change + 2.0 * rate * speed + acceleration * place,
    ]
    found: Array = old + np.stack(added, axis=1)
    return found
