"""Whether the numbers of one topic can be what the contract says: units, ranges, signs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cspm_control.plausibility.make import machine_size
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_observation import Array, Finding, Heard
from cspm_ros.check_drivers.driver_relation import (
    LENGTH_UNITS,
    SPEED_UNITS,
    TENSION_UNITS,
    Series,
    Verdict,
    grouped,
    rate_relation,
    verdict_on,
)

LOWEST_TENSION = -1.0  # N, what a zero offset may make of a slack cable
LIMIT_MARGIN = 1.5  # of the tension and torque limits
HANGING, NOT_HANGING = 0.6, 0.05  # share of the bar's weight
SMALLEST_MACHINE = 1.0  # m
FARTHEST, MOST_MOVEMENT, TYPICAL = 30.0, 5.0, 1.5  # of the machine's size
TREMBLING = 100.0  # times the noise in the test-bed
NORM_TOLERANCE = 1e-3
LARGEST_TILT, SMALL_TILT = np.radians(90.0), np.radians(45.0)
COUNTED_VALUES = 3
WRAPS = {2.0 * np.pi: "2π", 360.0: "360"}
WRAP_TOLERANCE = 0.05


def check_units(heard: Heard, testbed: Testbed) -> list[Finding]:
    """Judge finite numbers of one topic by themselves and by the test-bed's description."""
    kind = heard.topic.name.rpartition("/")[2]
    if kind == "tension":
        return _tensions(heard, testbed)
    if kind == "state":
        return _angles(heard) + _torques(heard, testbed)
    if kind == "pose":
        return [_position(heard, testbed), *_trembling(heard, testbed), _quaternion(heard)]
    return []


def _tensions(heard: Heard, testbed: Testbed) -> list[Finding]:
    tensions, name = heard.part("effort"), heard.topic.name
    if tensions is None:
        return []
    if all(_whole(column) for column in tensions.T):
        text = "whole numbers only: looks like raw counts, expected N"
        return [Finding(name, "units", False, text)]
    middles = np.median(tensions, axis=0)
    names = np.array(testbed.cable_names)
    if (middles < LOWEST_TENSION).any():
        where = ", ".join(names[middles < LOWEST_TENSION])
        text = f"{where}: negative, median {middles.min():.4g}: inverted, or not zeroed?"
        return [Finding(name, "units", False, text)]
    limits = [c.tension_limits[1] if c.tension_limits else np.inf for c in testbed.cables]
    ok, text = _total(tensions, testbed)
    if ok:
        text = f"medians {middles.min():.4g} to {middles.max():.4g} N"
        beyond = _beyond(tensions, limits, "N", testbed)
        ok, text = not beyond, beyond or text
    return [Finding(name, "units", ok, text)]


def _beyond(values: Array, limits: Sequence[float], unit: str, testbed: Testbed) -> str:
    """Return which cables' values (m, n) are too far beyond their limits, empty if none are."""
    reached = np.percentile(np.abs(values), 99, axis=0)
    found = zip(testbed.cable_names, reached, limits, strict=True)
    return ", ".join(
        f"{name} reaches {high:.4g} {unit} (the test-bed's limit is {limit:g})"
        for name, high, limit in found
        if high > LIMIT_MARGIN * limit
    )


def _total(tensions: Array, testbed: Testbed) -> Verdict:
    """Judge the sum of tensions (m, n), which under a hanging bar is about its weight or more."""
    if testbed.bar is None or not testbed.gravity:
        return True, ""
    weight = testbed.bar.mass * testbed.gravity
    total = float(np.mean(tensions.sum(axis=1)))
    limits = [cable.tension_limits[1] for cable in testbed.cables if cable.tension_limits]
    ratio, most = total / weight, LIMIT_MARGIN * sum(limits) / weight
    text = f"{total:.4g} in total where gravity gives {weight:.4g} N or more"
    if abs(ratio) < NOT_HANGING:
        return None, f"{text}: does the bar hang, and is this in N?"
    if HANGING <= ratio <= most:
        return True, text
    fits = [unit for factor, unit in TENSION_UNITS.items() if 0.9 <= ratio / factor <= most]
    guess = f"looks {fits[0]}" if fits else "not in N, or the bar does not hang freely"
    return False, f"{guess}: {text}"


def _whole(values: Array) -> bool:
    """Return whether a signal takes whole numbers only, and several of them."""
    return bool((values == np.round(values)).all()) and len(np.unique(values)) >= COUNTED_VALUES


def counted_through(angle: Series) -> tuple[Series, str]:
    """Return an angle without jumps by whole turns, and by what it jumps, empty if it does not."""
    intervals = np.diff(angle.times)
    # Over a lost message a fast drum may well turn as far.
    jumps = np.abs(np.diff(angle.values))[intervals < 1.5 * np.median(intervals)]
    for size, text in WRAPS.items():
        allowed = WRAP_TOLERANCE * size
        if (np.abs(jumps - size) < allowed).any() and np.median(jumps) < allowed:
            return angle._replace(values=np.unwrap(angle.values, period=size)), text
    return angle, ""


def _angles(heard: Heard) -> list[Finding]:
    """Judge each winch's angle by itself, and its speed by the angle."""
    name, ordered = heard.topic.name, heard.in_order()
    if ordered is None:
        return [Finding(name, "speed", None, "cannot decide without increasing stamps")]
    angles, speeds = ordered.part("position"), ordered.part("velocity")
    if angles is None:
        return []
    units: dict[str, Verdict] = {}
    derivatives: dict[str, Verdict] = {}
    for i, cable in enumerate(heard.topic.joint_names):
        angle, jump = counted_through(Series(ordered.value_times, angles[:, i]))
        units[cable] = _angle_verdict(angle, jump)
        if speeds is not None and not _whole(angle.values):
            relation = rate_relation(angle, Series(ordered.value_times, speeds[:, i]))
            what = "the derivative of the angle"
            derivatives[cable] = verdict_on(relation, SPEED_UNITS, what)
    return grouped(name, "units", units) + grouped(name, "speed", derivatives)


def _angle_verdict(angle: Series, jump: str) -> Verdict:
    if jump:
        return False, f"the angle jumps by {jump}, expected: turns are counted"
    if _whole(angle.values):
        text = "whole numbers only: looks like encoder counts, expected rad at the motor shaft"
        return False, text
    return True, "angles neither in counts nor jumping"


def _torques(heard: Heard, testbed: Testbed) -> list[Finding]:
    torques, name = heard.part("effort"), heard.topic.name
    if torques is None:
        return []
    if not torques.any():
        text = "always 0: is the torque filled, and are the drives on?"
        return [Finding(name, "torque", None, text)]
    beyond = _beyond(torques, [cable.torque_limit for cable in testbed.cables], "N·m", testbed)
    return [Finding(name, "torque", not beyond, beyond or "within the torque limits")]


def _position(heard: Heard, testbed: Testbed) -> Finding:
    name, size = heard.topic.name, max(SMALLEST_MACHINE, machine_size(testbed))
    position = heard.values[:, :3]
    distance = float(np.median(np.linalg.norm(position, axis=1)))
    movement = float(np.ptp(position, axis=0).max())
    text = f"{distance:.4g} from the origin, moves by {movement:.4g}"
    if distance <= FARTHEST * size and movement <= MOST_MOVEMENT * size:
        return Finding(name, "units", True, f"{text} m")
    scale = distance / (TYPICAL * size) if distance > FARTHEST * size else max(LENGTH_UNITS)
    unit = LENGTH_UNITS[min(LENGTH_UNITS, key=lambda factor: abs(np.log(scale / factor)))]
    text = f"looks {unit}: {text}, where the machine's size is {size:.3g} m"
    return Finding(name, "units", False, text)


def _trembling(heard: Heard, testbed: Testbed) -> list[Finding]:
    """Warn of noise far above the test-bed's: all that betrays the unit of a still body at 0."""
    sensor, ordered = testbed.sensors.get(heard.topic.name), heard.in_order()
    if sensor is None or ordered is None or not sensor.noise[0]:
        return []
    times, expected = ordered.value_times, sensor.noise[0]
    noise = max(Series(times, column).noise for column in ordered.values[:, :3].T)
    if not np.isfinite(noise) or noise < TREMBLING * expected:
        return []
    text = f"position trembles by {noise:.2g} where the test-bed says {expected:g} m"
    return [Finding(heard.topic.name, "noise", None, f"{text}: in millimetres?")]


def _quaternion(heard: Heard) -> Finding:
    name, quaternion = heard.topic.name, heard.values[:, 3:]
    norms = np.linalg.norm(quaternion, axis=1)
    worst = float(norms[np.argmax(np.abs(norms - 1.0))])
    if abs(worst - 1.0) > NORM_TOLERANCE:
        hint = ": it is not filled" if worst == 0.0 else ""
        text = f"quaternion of length {worst:.4g}, expected 1{hint}"
        return Finding(name, "quaternion", False, text)
    tilt = float(np.median(_tilt(quaternion)))
    if tilt < LARGEST_TILT:
        text = f"unit length, tilted by {np.degrees(tilt):.1f}°"
        return Finding(name, "quaternion", True, text)
    text = f"read as x y z w the body is tilted by {np.degrees(tilt):.0f}°"
    if float(np.median(_tilt(np.roll(quaternion, -1, axis=1)))) < SMALL_TILT:
        text += ": looks like w first, or the body's z axis points up"
    return Finding(name, "quaternion", False, text)


def _tilt(quaternion: Array) -> Array:
    """Return the angle between the body's z axis and the world's, (n,) [rad], of x y z w (n, 4)."""
    x, y = quaternion[:, 0], quaternion[:, 1]
    return np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
