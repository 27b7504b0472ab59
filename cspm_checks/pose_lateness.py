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
from cspm_checks.series import Log, SensorSeries, TopicColumns, series_of
from cspm_model.kernels.trajectory import eulers_along, lengths_along
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE

Array = NDArray[np.float64]
STATE, BAR, FRAME = "/winches/state", "/bar/pose", "/winch_frame/pose"
# Fewer give no error that is worth having.
FEWEST_WINCHES = 3


def comparable(messages: Log, testbed: Testbed) -> bool:
    """Return whether there are a bar's pose and the angles of winches that carry it."""
    state = messages.get(STATE)
    angles = state is not None and "position" in state.topic.parts
    cables = sum(cable.has_cable for cable in testbed.cables)
    return angles and BAR in messages and cables >= FEWEST_WINCHES


def pose_lateness(messages: Log, testbed: Testbed, origin_ns: int) -> Lateness | None:
    """Return how late poses are against the winches; None where the signals cannot tell.

    Args:
        messages: what was imported, by topic; `comparable`.
        testbed: the machine.
        origin_ns: the instant from which times count [ns].
    """
    time, lengths = _lengths(messages, testbed, origin_ns)
    found = []
    for i, cable in enumerate(testbed.cables):
        if cable.has_cable:
            angle = series_of(messages[STATE], f"position/{cable.name}", origin_ns)
            found.append(lateness(angle, SensorSeries(time, lengths[:, i]), [], (0,)))
    told = [late for late in found if late is not None]
    return _of_all(told) if len(told) >= FEWEST_WINCHES else None


def _lengths(messages: Log, testbed: Testbed, origin_ns: int) -> tuple[Array, Array]:
    """Return instants of the bar's pose [s], shape (k,), and lengths there, shape (k, n) [m]."""
    time, bar = _poses(messages[BAR], origin_ns)
    frame = np.zeros_like(bar)
    if FRAME in messages:
        at, poses = _poses(messages[FRAME], origin_ns)
        frame = np.stack([np.interp(time, at, column) for column in poses.T], axis=1)
    cables = nominal_parameters(testbed).cables
    lengths, bar_rates, frame_rates = np.empty((3, len(time), len(cables)))
    still = np.zeros_like(bar)
    lengths_along(cables, bar, frame, still, still, lengths, bar_rates, frame_rates)
    return time, lengths


def _poses(topic: TopicColumns, origin_ns: int) -> tuple[Array, Array]:
    """Return instants [s], shape (k,), and poses with Euler angles, shape (k, 6)."""
    rows, stamps = topic.rows(slice(None)), topic.stamp_ns
    order = np.argsort(stamps, kind="stable")
    order = order[~np.isnan(rows[order]).any(axis=1)]
    rows = rows[order]
    angles = np.empty((len(rows), 3))
    eulers_along(np.ascontiguousarray(rows[:, POSE.index("qx") : POSE.index("qw") + 1]), angles)
    angles = np.unwrap(angles, axis=0)
    time = np.asarray((stamps[order] - origin_ns) * 1e-9, dtype=np.float64)
    return time, np.ascontiguousarray(np.concatenate([rows[:, :3], angles], axis=1))


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
