"""Whether channels that physics ties together agree: factor and sign.

Only for these checks, signals are integrated, and brought to common instants where two topics meet;
nothing of it is recorded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.robust_line import RobustLine, robust_line
from cspm_ident.importing.suspicion import Suspicion
from cspm_ident.importing.time_base import GAP
from cspm_ident.importing.topic_messages import TopicMessages
from cspm_ident.importing.value_suspicions import resolution
from cspm_msgs_py.testbed import Testbed

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


class SensorSeries(NamedTuple):
    """A channel without NaN: instants [s] and values [SI], both shape (n,)."""

    time: Array
    values: Array


def relation_suspicions(messages: Mapping[str, TopicMessages], testbed: Testbed) -> list[Suspicion]:
    """Return which channels contradict each other."""
    found: list[Suspicion] = []
    origin = min(int(one.stamp_ns.min()) for one in messages.values())
    for where, position, velocity in _position_pairs(messages, origin):
        found += velocity_suspicions(where, position, velocity)
    state = messages.get(_STATE)
    if state is None or "effort" not in state.topic.parts:
        return found
    for cable in testbed.cables:
        torque = _signal(state, f"effort/{cable.name}", origin)
        if "position" in state.topic.parts:
            angle = _signal(state, f"position/{cable.name}", origin)
            found += power_suspicions(f"{_STATE} effort/{cable.name}", angle, torque)
        if _TENSION in messages:
            tension = _signal(messages[_TENSION], f"effort/{cable.name}", origin)
            radius = cable.drum_radius / cable.gear_ratio
            where = f"{_STATE} effort/{cable.name}"
            found += torque_suspicions(where, torque, tension, radius)
    return found


def _position_pairs(
    messages: Mapping[str, TopicMessages], origin_ns: int
) -> Iterator[tuple[str, SensorSeries, SensorSeries]]:
    """Yield name, position and velocity of what has both."""
    for topic in messages.values():
        if {"position", "velocity"} <= set(topic.topic.parts):
            for joint in topic.topic.joint_names:
                yield (
                    f"{topic.topic.name} velocity/{joint}",
                    _signal(topic, f"position/{joint}", origin_ns),
                    _signal(topic, f"velocity/{joint}", origin_ns),
                )
    for body in ("/winch_frame", "/bar"):
        pose, twist = messages.get(f"{body}/pose"), messages.get(f"{body}/twist")
        if pose and twist:
            for axis in "xyz":
                yield (
                    f"{body}/twist v{axis}",
                    _signal(pose, axis, origin_ns),
                    _signal(twist, f"v{axis}", origin_ns),
                )


def _signal(topic: TopicMessages, field: str, origin_ns: int) -> SensorSeries:
    values = topic.values(field)
    order = np.argsort(topic.stamp_ns, kind="stable")
    order = order[~np.isnan(values[order])]
    time = np.asarray((topic.stamp_ns[order] - origin_ns) * 1e-9, dtype=np.float64)
    return SensorSeries(time, values[order])


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
    text = f"velocity does not integrate to position: factor {_told(line)}"
    return [Suspicion(where, "velocity", text, numbers)]


def _told(line: RobustLine) -> str:
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


def power_suspicions(where: str, angle: SensorSeries, torque: SensorSeries) -> list[Suspicion]:
    """Return whether a winch gives energy where friction must take it.

    Without its mean, which hoists and lowers, torque times change of angle sums up to what is
    dissipated; what is stored comes back.
    """
    if len(angle.values) != len(torque.values) or len(angle.values) < 2:
        return []
    middle = (torque.values[1:] + torque.values[:-1]) / 2 - torque.values.mean()
    work = middle * np.diff(angle.values)
    flow, total = float(np.abs(work).sum()), float(work.sum())
    if total >= -DISSIPATED * flow:
        return []
    text = f"torque times speed gives {-total:.4g} J, {-total / flow:.0%} of what flows, where"
    text += " friction takes energy: sign of torque or angle?"
    return [Suspicion(where, "power", text, {"work": total, "flow": flow})]


def torque_suspicions(
    where: str, torque: SensorSeries, tension: SensorSeries, radius: float
) -> list[Suspicion]:
    """Return whether torque and tension times drum radius over gear ratio [m] are far apart."""
    if len(torque.values) < _WINDOW or len(tension.values) < _WINDOW:
        return []
    every = max(len(torque.values) // _MOST_POINTS, 1)
    time, found = torque.time[::every], torque.values[::every]
    inside = (time >= tension.time[0]) & (time <= tension.time[-1])
    wanted = np.interp(time[inside], tension.time, tension.values) * radius
    line = robust_line(wanted, found[inside], np.ones(len(wanted)))
    if line is None or line.explained < EXPLAINED or 0.5 <= line.slope <= 2.0:
        return []
    text = f"torque is not tension times drum radius over gear ratio: factor {abs(line.slope):.4g},"
    text += f" sign {'−' if line.slope < 0 else '+'}"
    return [Suspicion(where, "torque", text, line._asdict())]
