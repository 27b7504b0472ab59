"""A recorded motion, read from CSV and laid on knots.

Header `t,x,y,z,roll,pitch,yaw`; s, m, rad. The scenario's t = 0 is the file's t = 0; rows before
it only shape the curve. The curve is the cubic spline through the rows (not-a-knot), with
continuous acceleration. Nothing is extrapolated: after the last row the body stands still.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from math import ceil, isfinite, pi
from pathlib import Path

import numpy as np
import scipy

from cspm_control.waves.realisation import checked_count
from cspm_control.waves.sea import Array
from cspm_msgs_py.errors import InputError

COLUMNS = ("t", "x", "y", "z", "roll", "pitch", "yaw")


def read_motion(path: Path) -> Array:
    """Return the file's rows t, x, y, z, roll, pitch, yaw, shape (n ≥ 2, 7).

    Raises:
        InputError: naming file, line and column, and what is allowed.
    """
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            return _parse(csv.reader(stream), str(path))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, allowed: a CSV file of a motion") from None
    except (OSError, UnicodeDecodeError, csv.Error) as err:
        raise InputError(f"{path}: not a readable CSV file ({err})") from None


def motion_knots(rows: Array, rate: float | None) -> tuple[Array, float]:
    """Return knots of the spline through `rows` from t = 0 to the last row, and their spacing [s].

    Args:
        rows: as from `read_motion`.
        rate: least number of knots per second [Hz]; None for the rows' shortest step.

    Raises:
        InputError: the motion has more knots than can be stored.
    """
    time, pose = rows[:, 0], rows[:, 1:]
    end = float(time[-1])
    step = float(np.diff(time).min()) if rate is None else 1.0 / rate
    intervals = max(1, ceil(end / step - 1e-6))
    checked_count(intervals + 1)
    instants = np.linspace(0.0, end, intervals + 1)
    spline = scipy.interpolate.CubicSpline(time, pose, axis=0)
    return np.hstack([spline(instants, order) for order in (0, 1, 2)]), end / intervals


def _parse(lines: Iterable[list[str]], source: str) -> Array:
    table: list[list[float]] = []
    header = False
    for number, cells in enumerate(lines, start=1):
        if not header:
            _check_header(cells, source)
            header = True
        elif cells:
            table.append(_row(cells, f"{source}: line {number}"))
            _check_step(table, f"{source}: line {number}")
    if not header:
        raise InputError(f"{source}: an empty file, allowed: the header {','.join(COLUMNS)}")
    if len(table) < 2 or table[-1][0] <= 0.0 or table[0][0] > 0.0:
        raise InputError(
            f"{source}: {_extent(table)}, allowed: two rows or more, the first at or before t = 0,"
            " the last after it"
        )
    return np.array(table)


def _check_header(cells: list[str], source: str) -> None:
    names = tuple(cell.strip().lstrip("\ufeff") for cell in cells)
    if names != COLUMNS:
        raise InputError(
            f"{source}: line 1: header {','.join(names)[:60]!r}, allowed: {','.join(COLUMNS)}"
        )


def _row(cells: list[str], place: str) -> list[float]:
    if len(cells) != len(COLUMNS):
        raise InputError(f"{place}: {len(cells)} columns, allowed: {len(COLUMNS)}")
    return [_number(cell, name, place) for cell, name in zip(cells, COLUMNS, strict=True)]


def _number(cell: str, name: str, place: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise InputError(f"{place}: column {name}: {cell.strip()[:60]!r}, allowed: a finite number")
    if name in ("roll", "pitch") and abs(value) >= pi / 2:
        raise InputError(
            f"{place}: column {name}: {value:g} rad, allowed: between -π/2 and π/2; degrees have to"
            " be converted"
        )
    return value


def _check_step(table: list[list[float]], place: str) -> None:
    if len(table) < 2:
        return
    before, now = table[-2], table[-1]
    if now[0] <= before[0]:
        raise InputError(f"{place}: column t: {now[0]:g} s, allowed: after {before[0]:g} s")
    if abs(now[6] - before[6]) >= pi:
        raise InputError(
            f"{place}: column yaw: a step from {before[6]:g} to {now[6]:g} rad, allowed: less"
            " than π (unwrapped angles)"
        )


def _extent(table: list[list[float]]) -> str:
    if not table:
        return "no rows"
    return f"{len(table)} rows from t = {table[0][0]:g} to {table[-1][0]:g} s"
