"""Whether channels that physics ties together agree: factor and sign.

Only for these checks, signals are integrated, and brought to common instants where two topics meet;
nothing of it is recorded.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cspm_checks.drive_balance import Balance, drive_balance
from cspm_checks.lateness import Lateness, lateness
from cspm_checks.pace import GAP
from cspm_checks.robust_line import RobustLine, robust_line
from cspm_checks.series import Log, SensorSeries, TopicColumns, series_of
from cspm_checks.stuck import stuck_suspicions
from cspm_checks.suspicion import Suspicion
from cspm_checks.value_suspicions import resolution
from cspm_msgs_py.testbed import Cable, Testbed

Array = NDArray[np.float64]
FACTOR_TOLERANCE = 0.02
_HINT_TOLERANCE = 0.01
EXPLAINED = 0.5
DISSIPATED = 0.05
_WINDOW = 50  # samples
_MOST_WINDOWS = 2000
_MOST_POINTS = 20_000
_STATE, _TENSION = "/winches/state", "/cables/tension"
_LIKELY = {
    2 * np.pi / 60: "velocity in rpm taken for rad/s?",
    np.pi / 180: "velocity in deg/s taken for rad/s?",
    180 / np.pi: "position in deg taken for rad?",
    2 * np.pi: "velocity in turns/s taken for rad/s?",
    1 / (2 * np.pi): "position in turns taken for rad?",
    1000.0: "mm for m, or time in ms for s?",
    0.001: "mm for m, or time in ms for s?",
    2.0: "counts per turn, or half or double the rate?",
    4.0: "encoder lines taken for counts?",
    0.25: "encoder counts taken for lines?",
    0.5: "counts per turn, or half or double the rate?",
}


def relation_suspicions(
    messages: Log, testbed: Testbed, poses: Lateness | None, origin_ns: int
) -> list[Suspicion]:
    """Return which channels contradict each other.

    Args:
        messages: what was imported, by topic.
        testbed: the machine.
        poses: how late they are, if that can be said.
        origin_ns: the instant from which times count [ns].
    """
    found: list[Suspicion] = []
    for where, position, velocity in _position_pairs(messages, origin_ns):
        found += velocity_suspicions(where, position, velocity)
        found += stuck_suspicions(where.replace("velocity", "position"), position, velocity)
        found += late_suspicions(where, "the position", lateness(velocity, position, [], (1,)))
    if poses is not None:
        found += late_suspicions("/bar/pose", "the winches, by inverse kinematics", poses)
    state = messages.get(_STATE)
    if state is not None and "effort" in state.topic.parts:
        for cable in testbed.cables:
            rides = testbed.winch_frame is not None
            found += _torque_relations(state, messages.get(_TENSION), cable, origin_ns, rides=rides)
    return found


def _torque_relations(
    state: TopicColumns,
    cells: TopicColumns | None,
    cable: Cable,
    origin_ns: int,
    *,
    rides: bool,
) -> list[Suspicion]:
    """Return what contradicts the torque of one winch, which may ride on a moving frame."""
    where = f"{_STATE} effort/{cable.name}"
    torque = series_of(state, f"effort/{cable.name}", origin_ns)
    tension = None
    if cells is not None:
        measured = series_of(cells, f"effort/{cable.name}", origin_ns)
        tension = measured if len(measured.values) else None
    radius = cable.wound_radius
    if "position" not in state.topic.parts:
        return [] if tension is None else torque_suspicions(where, torque, tension, radius)
    angle = series_of(state, f"position/{cable.name}", origin_ns)
    # Without load cell a cable's tension goes with the angle.
    orders = (1, 2) if tension is not None or not cable.has_cable else (0, 1, 2)
    late = lateness(torque, angle, [] if tension is None else [tension], orders)
    found = late_suspicions(where, "the motion", late)
    # Waves that move the winches do work on cables that nobody measures.
    if tension is not None or not cable.has_cable or not rides:
        pull = None if tension is None else tension._replace(values=tension.values * radius)
        balance = drive_balance(torque, angle, pull, elastic=cable.has_cable)
        found += balance_suspicions(where, balance)
    return found


def balance_suspicions(where: str, balance: Balance | None) -> list[Suspicion]:
    """Return whether a torque has not the signs of friction, inertia and the cable's pull."""
    if balance is None:
        return []
    found, (friction, inertia, drum, level) = [], balance
    # A wrong sign reverses both; a loop that feeds back noise bends friction alone.
    may_be = not (inertia.is_sure and inertia.mean > 0.0)
    if friction.is_sure and friction.mean < -DISSIPATED and may_be:
        text = f"torque times speed gives {-friction.mean:.0%} of what flows, where friction takes"
        text += " energy: sign of torque or angle?"
        found.append(Suspicion(where, "power", text, friction._asdict()))
    elif inertia.is_sure and inertia.mean < 0.0 and inertia.share > DISSIPATED:
        text = f"torque turns the winch the other way: inertia {inertia.mean:.3g} kg·m²"
        text += ": sign of torque or angle?"
        found.append(Suspicion(where, "power", text, inertia._asdict()))
    if drum is None or drum.share < EXPLAINED:
        return found
    # A force loop answers its load cell's noise with more torque than the pull, not on average.
    if any(each is not None and 0.5 <= each <= 2.0 for each in (drum.mean, level)):
        return found
    if abs(drum.mean - 1.0) > 4.0 * drum.error:
        found.append(_drum(where, drum.mean, drum._asdict()))
    return found


def _drum(where: str, factor: float, numbers: dict[str, float]) -> Suspicion:
    text = f"torque is not tension times drum radius over gear ratio: factor {abs(factor):.4g},"
    text += f" sign {'−' if factor < 0 else '+'}"
    return Suspicion(where, "torque", text, numbers)


def late_suspicions(where: str, leader: str, late: Lateness | None) -> list[Suspicion]:
    """Return whether a channel is late against a leader."""
    if late is None or not late.matters:
        return []
    size, unit = (1e3, "ms") if abs(late.seconds) < 1.0 else (1.0, "s")
    which = "late" if late.seconds > 0 else "early"
    text = (
        f"{size * abs(late.seconds):.4g} ± {size * late.error:.2g} {unit} {which} against {leader}"
    )
    if late.drift:
        text += f", and drifts by {late.drift:.3g} ± {late.drift_error:.2g} s per s"
    numbers = {
        "seconds": late.seconds,
        "error": late.error,
        "drift": late.drift,
        "drift_error": late.drift_error,
    }
    return [late_suspicion(where, text, numbers)]


def late_suspicion(where: str, text: str, numbers: dict[str, float]) -> Suspicion:
    """Return a lateness with the offset of a clock, and for a drift the skew, that mend it."""
    remedy = f"a `clock` of its own with `offset: {-numbers['seconds']:.6g}`"
    if numbers.get("drift"):
        remedy += f" and `skew: {-numbers['drift']:.3g}`"
    mend = {where: {"offset_s": -numbers["seconds"]}}
    return Suspicion(where, "late", text, numbers, remedy=remedy, mend=mend)


def _position_pairs(
    messages: Log, origin_ns: int
) -> Iterator[tuple[str, SensorSeries, SensorSeries]]:
    """Yield name, position and velocity of what has both."""
    for topic in messages.values():
        if {"position", "velocity"} <= set(topic.topic.parts):
            for joint in topic.topic.joint_names:
                yield (
                    f"{topic.topic.name} velocity/{joint}",
                    series_of(topic, f"position/{joint}", origin_ns),
                    series_of(topic, f"velocity/{joint}", origin_ns),
                )
    for body in ("/winch_frame", "/bar"):
        pose, twist = messages.get(f"{body}/pose"), messages.get(f"{body}/twist")
        if pose and twist:
            for axis in "xyz":
                yield (
                    f"{body}/twist v{axis}",
                    series_of(pose, axis, origin_ns),
                    series_of(twist, f"v{axis}", origin_ns),
                )


def velocity_suspicions(
    where: str, position: SensorSeries, velocity: SensorSeries
) -> list[Suspicion]:
    """Return whether the integral of a velocity is not the position.

    Regression of position over windows on integrated velocity, with a constant bias of velocity.
    """
    if len(position.values) < 4 * _WINDOW or len(velocity.values) < 4 * _WINDOW:
        return []
    change, moved, duration = _windows(position, velocity)
    fine = resolution(position.values) or 0.0
    if len(change) < 8 or np.std(change) <= 3 * fine or not moved.any():
        return []
    line = robust_line(moved, change, duration)
    if line is None:
        return []
    numbers = line._asdict()
    if line.explained < EXPLAINED:
        text = f"velocity and position are not related ({line.explained:.0%} explained)"
        return [Suspicion(where, "unrelated", text, numbers)]
    if abs(line.slope - 1.0) <= max(FACTOR_TOLERANCE, 4 * line.error):
        return []
    text = f"velocity does not integrate to position: factor {_described(line)}"
    return [Suspicion(where, "velocity", text, numbers)]


def _described(line: RobustLine) -> str:
    factor = abs(line.slope)
    likely = [text for value, text in _LIKELY.items() if abs(factor / value - 1) < _HINT_TOLERANCE]
    hint = f" ({likely[0]})" if likely else ""
    return f"{factor:.4g}, sign {'−' if line.slope < 0 else '+'}{hint}"


def _windows(position: SensorSeries, velocity: SensorSeries) -> tuple[Array, Array, Array]:
    """Return over windows without gaps: change of position, integral of velocity, duration."""
    integral = np.concatenate(
        [
            [0.0],
            np.cumsum(np.diff(velocity.time) * (velocity.values[1:] + velocity.values[:-1]) / 2),
        ]
    )
    count = min(len(position.time) // _WINDOW, _MOST_WINDOWS)
    edges = np.linspace(0, len(position.time) - 1, count + 1).astype(int)
    time = position.time[edges]
    moved = np.diff(np.interp(time, velocity.time, integral))
    inside = (time[:-1] >= velocity.time[0]) & (time[1:] <= velocity.time[-1])
    for signal in (position, velocity):
        steps = np.diff(signal.time)
        gaps = np.concatenate([[0], np.cumsum(steps > GAP * np.median(steps))])
        at = np.searchsorted(signal.time, time, side="right") - 1
        inside &= np.diff(gaps[np.maximum(at, 0)]) == 0
    change, duration = np.diff(position.values[edges]), np.diff(time)
    return change[inside], moved[inside], duration[inside]


def torque_suspicions(
    where: str, torque: SensorSeries, tension: SensorSeries, radius: float
) -> list[Suspicion]:
    """Return whether torque and tension times drum radius over gear ratio [m] are far apart."""
    if len(torque.values) < _WINDOW or len(tension.values) < _WINDOW or not np.ptp(torque.values):
        return []
    every = max(len(torque.values) // _MOST_POINTS, 1)
    time, found = torque.time[::every], torque.values[::every]
    inside = (time >= tension.time[0]) & (time <= tension.time[-1])
    wanted = np.interp(time[inside], tension.time, tension.values) * radius
    line = robust_line(wanted, found[inside], np.ones(len(wanted)))
    if line is None or line.explained < EXPLAINED or 0.5 <= line.slope <= 2.0:
        return []
    return [_drum(where, line.slope, line._asdict())]
