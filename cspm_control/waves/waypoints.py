"""From point to point in straight lines, on knots."""

from __future__ import annotations

from math import sqrt

import numpy as np
import scipy

from cspm_control.waves.realisation import checked_count, envelope
from cspm_control.waves.sea import Array
from cspm_msgs_py.motion_spec import TIME_GRID
from cspm_msgs_py.scenario_keys.curves import Waypoint, WaypointsMotion

# Highest rate of 10s³ − 15s⁴ + 6s⁵.
PEAK_RATE = 1.875
SPACING = 5.0 * TIME_GRID


def waypoint_knots(spec: WaypointsMotion) -> tuple[Array, float]:
    """Return the knots (n, 18) of a sequence of waypoints from t = 0, and their spacing [s].

    Raises:
        InputError: the sequence needs more knots than can be stored.
    """
    legs, start, begin = [], np.zeros(6), 0.0
    for point in spec.points:
        way = np.array(point.to) - start
        shares = _shares(spec, point, way)
        legs.append((begin, start, way, shares))
        begin += float(shares[0][-1]) + point.pause
        start = np.array(point.to)
    count = checked_count(int(np.ceil(begin / SPACING)) + 2)
    time, knots = SPACING * np.arange(count), np.zeros((count, 18))
    for first, _, way, (instants, *profile) in legs:
        inner = np.clip(time - first, 0.0, instants[-1])
        for order, values in enumerate(profile):
            share = np.interp(inner, instants, values)
            knots[:, 6 * order : 6 * order + 6] += np.outer(share, way)
    return knots, SPACING


def _shares(spec: WaypointsMotion, point: Waypoint, way: Array) -> tuple[Array, ...]:
    """Return instants [s] and the share of the way with its two derivatives, each (n,)."""
    length = float(np.linalg.norm(way[:3]) or np.linalg.norm(way[3:]))
    if point.duration is not None or not length:
        return _quintic(point.duration or SPACING)
    assert point.speed is not None
    if spec.profile == "quintic":
        return _quintic(PEAK_RATE * length / point.speed)
    return _jerk_limited(length, point.speed, spec.acceleration, spec.jerk)


def _quintic(duration: float) -> tuple[Array, ...]:
    time = np.linspace(0.0, duration, max(2, int(np.ceil(duration / TIME_GRID)) + 1))
    return (time, *envelope(time, duration))


def _jerk_limited(length: float, speed: float, most: float, jerk: float) -> tuple[Array, ...]:
    """Return the profile of seven phases with constant jerk, symmetric, at rest at both ends."""

    def rise(peak: float) -> float:
        """Return the time within which the speed rises to a peak."""
        return peak / most + most / jerk if peak * jerk >= most**2 else 2.0 * sqrt(peak / jerk)

    def beyond(peak: float) -> float:
        return peak * rise(peak) - length

    peak = speed if beyond(speed) <= 0.0 else scipy.optimize.brentq(beyond, 0.0, speed)
    ramp = min(most / jerk, sqrt(peak / jerk))
    hold, cruise = rise(peak) - 2.0 * ramp, max(0.0, length / peak - rise(peak))
    phases = np.array([ramp, hold, ramp, cruise, ramp, hold, ramp])
    signs = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])
    ends = np.concatenate([[0.0], np.cumsum(phases)])
    time = np.union1d(np.arange(0.0, ends[-1], TIME_GRID), ends)
    steps = np.diff(time)
    pushes = jerk * signs[np.clip(np.searchsorted(ends, time[:-1], "right") - 1, 0, 6)]
    bend = np.concatenate([[0.0], np.cumsum(pushes * steps)])
    rate = np.concatenate([[0.0], np.cumsum(bend[:-1] * steps + 0.5 * pushes * steps**2)])
    moved = rate[:-1] * steps + 0.5 * bend[:-1] * steps**2 + pushes * steps**3 / 6.0
    place = np.concatenate([[0.0], np.cumsum(moved)])
    return time, place / length, rate / length, bend / length
