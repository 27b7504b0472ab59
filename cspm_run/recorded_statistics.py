"""What a recorded run amounts to, from its messages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    TENSION,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
)
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_run.run_statistics import KEPT_PERIOD, RunStatistics, torque_limits
from cspm_run.stability.saturation import count_at_limit

Array = NDArray[np.float64]


def recording_statistics(path: Path, testbed: Testbed) -> RunStatistics:
    """Return errors and tensions of a recording: true ones, or measured where no truth is there.

    The share of infeasible wrenches is what the tension distribution reported.

    Raises:
        InputError: the recording cannot be read.
    """
    with Recording(path) as recording:
        counts = {name: topic.count for name, topic in recording.topics.items()}
        tension = _present(counts, TENSION)
        pose = _present(counts, BAR_POSE)
        wanted = (tension, pose, BAR_REFERENCE, TORQUE_COMMAND)
        names = [name for name in wanted if name and counts.get(name)]
        rows = recording.rows_of(names)
        shares = _infeasible_shares(recording) if counts.get(DIAGNOSTICS.name) else np.zeros(0)
    if tension is None:
        return RunStatistics(1, len(testbed.cables))
    tensions = rows[tension]
    steps = len(tensions.rows)
    errors = np.zeros((steps, 6))
    if pose is not None and BAR_REFERENCE in rows:
        errors = _errors(tensions.log_ns, rows[pose], rows[BAR_REFERENCE])
    infeasible = np.zeros(steps, dtype=bool)
    infeasible[: round(float(shares.mean() * steps)) if len(shares) else 0] = True
    limit = np.array([0.0 if cable.has_cable else -1.0 for cable in testbed.cables])
    slack = np.any(tensions.rows <= limit, axis=1)
    torques, limits = _torques(tensions.log_ns, rows.get(TORQUE_COMMAND)), torque_limits(testbed)
    period = 1e-9 * float(np.median(np.diff(tensions.log_ns))) if steps > 1 else KEPT_PERIOD
    statistics = RunStatistics(steps, tensions.rows.shape[1], period)
    for i in range(steps):
        saturated = count_at_limit(statistics.drives, torques[i], limits) if len(torques) else False
        met = bool(slack[i]), bool(infeasible[i]), saturated
        statistics.add(errors[i], tensions.rows[i], *met)
    return statistics


def _torques(at_ns: NDArray[np.int64], torques: Rows | None) -> Array:
    """Return the commanded torques at some instants, (k, n) [N·m]; none where none are known."""
    if torques is None or not len(torques.rows):
        return np.zeros((0, 0))
    return _held(at_ns, torques)


def _present(counts: dict[str, int], name: str) -> str | None:
    return next((found for found in ("/truth" + name, name) if counts.get(found)), None)


def _errors(at_ns: NDArray[np.int64], pose: Rows, reference: Rows) -> Array:
    """Return reference − pose (n, 6) [m, rad], both as last known at each instant."""
    difference = _values(_held(at_ns, reference)) - _values(_held(at_ns, pose))
    difference[:, 3:] = (difference[:, 3:] + np.pi) % (2.0 * np.pi) - np.pi
    return difference


def _held(at_ns: NDArray[np.int64], rows: Rows) -> Array:
    last = np.searchsorted(rows.log_ns, at_ns, side="right") - 1
    return rows.rows[np.maximum(last, 0)]


def _values(rows: Array) -> Array:
    """Return x y z φ θ ψ (n, 6) of pose rows."""
    yaw_pitch_roll = scipy.spatial.transform.Rotation.from_quat(rows[:, 3:7]).as_euler("ZYX")
    return np.hstack([rows[:, :3], yaw_pitch_roll[:, ::-1]])


def _infeasible_shares(recording: Recording) -> Array:
    """Return the shares that the tension distribution reported, each of about the same time."""
    reported = [
        status.values["infeasible_share"]
        for payload in recording.payloads(DIAGNOSTICS.name).payloads
        for status in decode_diagnostics(payload).statuses
        if status.name == TENSION_DISTRIBUTION and "infeasible_share" in status.values
    ]
    # The first of several is that of a single computation.
    return np.array(
        [share for text in reported[len(reported) > 1 :] if 0.0 <= (share := _number(text)) <= 1.0]
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan
