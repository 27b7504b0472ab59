"""Tables for `cspm import`, made of published files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import copyfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm.open_data.source import Table
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

# Of the kite's drum [m]: angle and torque are by this radius, and so is the test-bed file.
DRUM_RADIUS = 0.25
# Below this speed [m/s] power says nothing of torque.
_SLOWEST = 0.3
# By column of the table, the field of the recorded structure and how it is written.
_KUKA = {
    "t": ("time_disc", "%.4f"),
    "pos_deg": ("act_pos_mot_deg", "%.6f"),
    "vel_deg_s": ("act_vel_mot_deg_per_s", "%.5f"),
    "torque_nm": ("act_torque_abs_nm", "%.5f"),
    "ref_deg": ("ref_pos_deg", "%.6f"),
}


def make_table(table: Table, published: Path, place: Path) -> None:
    """Write a table.

    Args:
        table: which.
        published: the file that it is made of, in the cache or elsewhere.
        place: to write to.

    Raises:
        InputError: the published file has other contents than it should.
    """
    _MAKERS[table.make](table, published, place)


def _as_it_is(table: Table, published: Path, place: Path) -> None:
    copyfile(published, place)


def _kuka_axis(table: Table, published: Path, place: Path) -> None:
    """Write one axis: sample number, angle, speed, torque and wanted angle."""
    from scipy.io import loadmat

    try:
        record = loadmat(published, squeeze_me=True, struct_as_record=False)["rec"]
        columns = [_row(getattr(record, field), table.axis) for field, _ in _KUKA.values()]
    except (KeyError, AttributeError, IndexError, ValueError) as err:
        raise InputError(f"{published}: {err}, allowed: the structure `rec` with 6 axes") from None
    formats = [form for _, form in _KUKA.values()]
    np.savetxt(place, np.stack(columns, axis=1), formats, ",", header=",".join(_KUKA), comments="")


def _row(values: Any, axis: int) -> Array:  # noqa: ANN401 - whatever the file holds
    """Return an axis of a field (6, n), or the field (n,) where all axes share it."""
    array = np.asarray(values, dtype=np.float64)
    return array if array.ndim == 1 else array[axis - 1]


def _kite_winch(table: Table, published: Path, place: Path) -> None:
    """Write angle and torque of the drum, which follow from speed of the tether and power.

    ω = v/r; the angle is the trapezoidal sum of ω, the torque P/ω.
    """
    names = ("time", "ground_tether_reelout_speed", "ground_mech_power", "ground_tether_force")
    with published.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    try:
        time, speed, power, force = (np.array([float(row[name]) for row in rows]) for name in names)
    except (KeyError, ValueError) as err:
        raise InputError(f"{published}: {err}, allowed: columns {', '.join(names)}") from None
    turning = speed / DRUM_RADIUS
    torques = [
        "" if abs(v) < _SLOWEST else repr(float(p / w))
        for v, p, w in zip(speed, power, turning, strict=True)
    ]
    _write(place, np.round(time - time[0], 3), _turned(time, turning), turning, torques, force)


def _turned(time: Array, speed: Array) -> Array:
    """Return the trapezoidal integral of a speed, 0 at first."""
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _write(
    place: Path, time: Array, angle: Array, speed: Array, torque: Sequence[str], force: Array
) -> None:
    with place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t", "angle", "speed", "torque", "force_kg"])
        writer.writerows(
            (repr(float(t)), repr(float(a)), repr(float(w)), m, repr(float(f)))
            for t, a, w, m, f in zip(time, angle, speed, torque, force, strict=True)
        )


_MAKERS: dict[str, Callable[[Table, Path, Path], None]] = {
    "as_it_is": _as_it_is,
    "kuka_axis": _kuka_axis,
    "kite_winch": _kite_winch,
}
