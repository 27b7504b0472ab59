"""Accelerations that neither the drives nor the cables of a machine can give.

A wrong unit of angle, length or time shows here, and where speeds still look possible. The change
of mean speed from one window to the next needs no filter, and averages what sensors round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.channel import Channel
from cspm_checks.series import SensorSeries
from cspm_checks.suspicion import Suspicion
from cspm_checks.value_suspicions import OVER, cable_of, resolution
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
WINDOW_S, FEWEST_SAMPLES, FEWEST_WINDOWS = 0.05, 5, 50
LASTING = 13
"""The thirteenth largest counts: four wrong samples, which other checks report, change twelve."""
_UNEVEN = 0.2


def acceleration_suspicions(
    channel: Channel, series: SensorSeries, testbed: Testbed
) -> list[Suspicion]:
    """Return whether a position accelerates as the machine cannot.

    Args:
        channel: which it is.
        series: its values.
        testbed: the machine.
    """
    limit = _limit(channel.topic, channel.field, testbed)
    found = lasting_acceleration(series) if np.isfinite(limit) else None
    if found is None:
        return []
    largest, rounding = found
    if largest <= OVER * limit + rounding:
        return []
    unit = f"{channel.quantity}/s²"
    text = f"accelerates by {largest:.4g} {unit}, where torque, tension and weight allow"
    text += f" {limit:.4g}: unit of the position, or of time?"
    numbers = {"largest": largest, "limit": limit}
    return [Suspicion(channel.where, "implausible", text, numbers)]


def lasting_acceleration(series: SensorSeries) -> tuple[float, float] | None:
    """Return the thirteenth largest acceleration, and what rounding may add; None if too short.

    Args:
        series: of a position.
    """
    steps = np.diff(series.time)
    if len(steps) < FEWEST_WINDOWS * FEWEST_SAMPLES or not np.median(steps) > 0.0:
        return None
    # Where a unit of time is wrong, the whole recording may be shorter than a window.
    length = min(round(WINDOW_S / float(np.median(steps))), len(steps) // FEWEST_WINDOWS)
    length = max(FEWEST_SAMPLES, length)
    time, values = series.time[::length], series.values[::length]
    spans = np.diff(time)
    usual = float(np.median(spans))
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.diff(values) / spans
    regular = np.abs(spans - usual) < _UNEVEN * usual
    changes = np.abs(np.diff(rates))[regular[1:] & regular[:-1]] / usual
    if len(changes) < 2 * LASTING:
        return None
    rounding = 2.0 * (resolution(series.values) or 0.0) / usual**2
    return float(np.sort(changes)[-LASTING]), rounding


def _limit(topic: Topic, field: str, testbed: Testbed) -> float:
    """Return what drives and cables can give [rad/s² or m/s²], infinite where that is not known."""
    if topic.name == "/winches/state" and field.startswith("position/"):
        cable = cable_of(field, testbed)
        if cable.tension_limits is None:
            return np.inf
        pull = cable.tension_limits[1] * cable.drum_radius / cable.gear_ratio
        return float((cable.torque_limit + pull) / cable.rotor_inertia)
    if topic.name == "/bar/pose" and field in ("x", "y", "z") and testbed.bar is not None:
        pull = sum(cable.tension_limits[1] for cable in testbed.cables if cable.tension_limits)
        return float(pull / testbed.bar.mass + testbed.gravity)
    return np.inf
