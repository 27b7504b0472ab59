"""Which load cell is of which cable, and with which sign, as the drives' torques say.

A winch's torque is τ = (r/n)·t + J·q̈ + friction. With the right load cell's tension t, inertia and
friction explain nearly all of the rest; with another one they cannot.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cspm_checks.motion import even, motion_columns, smoothed
from cspm_checks.series import Log, SensorSeries, series_of
from cspm_checks.suspicion import Suspicion
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
STATE, TENSION = "/winches/state", "/cables/tension"
LESS = 0.5
"""Of what is left as it is: the other cell has to leave less, in each of the parts. Cables of which
two are pulled alike leave as much; with the right one nine tenths go."""
EXPLAINED = 0.5
PARTS = 4
_MOST_ROWS = 20_000


class _Drive(NamedTuple):
    """A winch at equal steps: torque, columns of inertia and friction, and pulls of all cells."""

    torque: Array
    motion: Array
    pulls: Array


def cell_suspicions(log: Log, testbed: Testbed, origin_ns: int) -> list[Suspicion]:
    """Return which load cells are exchanged or have the wrong sign.

    Args:
        log: the topics.
        testbed: the machine.
        origin_ns: the instant from which times count [ns].
    """
    drives, names = _drives(log, testbed, origin_ns)
    if not drives:
        return []
    # By part, winch, cell and sign; shape (parts, n, n, 2).
    left = np.array([[_left(each, part) for each in drives] for part in range(PARTS)])
    usual = np.median(left[..., 0], axis=0)
    order, signs = _assigned(np.median(left, axis=0))
    found = []
    for i, j in enumerate(order):
        if (j, signs[i]) == (i, 0):
            continue
        share = left[:, i, j, signs[i]] / np.maximum(left[:, i, i, 0], 1e-12)
        free = np.array([_alone(drives[i], part) for part in range(PARTS)])
        explains = left[:, i, j, signs[i]] < np.sqrt(1.0 - EXPLAINED) * free
        if (share > LESS).any() or not explains.all():
            return []
        # Inertia and friction that turn round with it say that it is the torque's sign.
        if signs[i] and not _is_passive(drives[i], int(j)):
            return []
        found.append((i, int(j), int(signs[i]), float(usual[i, i]), float(np.median(share))))
    mutual = [bool(order[each[1]] == each[0]) for each in found]
    return [
        _told(names, *each, mutual=both)
        for each, both in zip(found, mutual, strict=True)
        if each[0] <= each[1] or not both
    ]


def _told(
    names: list[str], i: int, j: int, sign: int, apart: float, share: float, *, mutual: bool
) -> Suspicion:
    mine, other = f"{TENSION} effort/{names[i]}", f"{TENSION} effort/{names[j]}"
    numbers = {"apart": apart, "share": share}
    after = f"leaves {share:.0%} of what it leaves as it is, {apart:.3g} N·m"
    if i == j:
        text = f"has the other sign: torque less inertia and friction then {after}"
        return Suspicion(mine, "reversed", text, numbers, mend={mine: {"sign": -1.0}})
    text = f"and effort/{names[j]} are exchanged: the" if mutual else "is of another cable: the"
    text += f" torque of {names[i]} follows the load cell called {names[j]}, which {after}"
    mend = {mine: {"of": other}} | ({other: {"of": mine}} if mutual else {})
    return Suspicion(mine, "exchanged", text, numbers, mend=mend)


def _drives(log: Log, testbed: Testbed, origin_ns: int) -> tuple[list[_Drive], list[str]]:
    """Return the winches whose angle, torque and tension are known, and their names."""
    state, cells = log.get(STATE), log.get(TENSION)
    if state is None or cells is None or not {"position", "effort"} <= set(state.topic.parts):
        return [], []
    chosen = [
        each
        for each in testbed.cables
        if each.has_cable and f"effort/{each.name}" in cells.measured
    ]
    if len(chosen) < 1:
        return [], []
    tensions = [series_of(cells, f"effort/{each.name}", origin_ns) for each in chosen]
    found = []
    for cable in chosen:
        angle = series_of(state, f"position/{cable.name}", origin_ns)
        torque = series_of(state, f"effort/{cable.name}", origin_ns)
        drive = _drive(angle, torque, tensions, cable.wound_radius)
        if drive is None:
            return [], []
        found.append(drive)
    return found, [each.name for each in chosen]


def _drive(
    angle: SensorSeries, torque: SensorSeries, tensions: list[SensorSeries], radius: float
) -> _Drive | None:
    regular = even(angle)
    if regular is None or not all(len(one.time) > 1 for one in (torque, *tensions)):
        return None
    time, values, step = regular
    motion = [*motion_columns(values, step, (2, 1)), np.ones(len(time))]
    pulls = [radius * smoothed(np.interp(time, one.time, one.values)) for one in tensions]
    goal = smoothed(np.interp(time, torque.time, torque.values))
    every = slice(None, None, max(len(time) // _MOST_ROWS, 1))
    return _Drive(goal[every], np.stack(motion, axis=1)[every], np.stack(pulls, axis=1)[every])


def _left(drive: _Drive, part: int) -> Array:
    """Return what a part of a torque leaves with each cell and sign, shape (n, 2) [N·m]."""
    rows = _rows(drive, part)
    torque, pulls = drive.torque[rows, None], drive.pulls[rows]
    goals = np.stack([torque - pulls, torque + pulls], axis=2)
    flat = goals.reshape(len(goals), -1)
    return np.asarray(_rest(drive.motion[rows], flat).reshape(goals.shape[1:]))


def _alone(drive: _Drive, part: int) -> float:
    """Return what a part of a torque leaves without any cell [N·m]."""
    rows = _rows(drive, part)
    return float(_rest(drive.motion[rows], drive.torque[rows, None])[0])


def _is_passive(drive: _Drive, cell: int) -> bool:
    """Return whether inertia and friction are positive with a cell's tension negated."""
    goal = drive.torque + drive.pulls[:, cell]
    inertia, viscous, dry, _ = np.linalg.lstsq(drive.motion, goal, rcond=None)[0]
    spin, speed, direction, _ = drive.motion.T
    taken = float(np.mean((viscous * speed + dry * direction) * speed)) / float(np.std(speed))
    return bool(inertia * float(np.std(spin)) + taken > 0.0)


def _rows(drive: _Drive, part: int) -> slice:
    length = len(drive.torque) // PARTS
    return slice(part * length, (part + 1) * length)


def _rest(table: Array, goals: Array) -> Array:
    solution = np.linalg.lstsq(table, goals, rcond=None)[0]
    return np.asarray(np.std(goals - table @ solution, axis=0))


def _assigned(left: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the cell, (n,), and sign, 0 for as it is, that leave least in all, as it is first."""
    cost = np.log(np.maximum(left, 1e-12))
    count = len(cost)
    cost[:, :, 0] -= np.log(1.0 / LESS) * np.eye(count)
    signs = cost.argmin(axis=2)
    order = linear_sum_assignment(cost.min(axis=2))[1]
    return order, signs[np.arange(count), order]
