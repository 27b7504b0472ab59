"""Whether a recording is long enough, moves, and does not stand still for most of the time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.data_look.data_check import DataCheck, check_of
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.prediction_noise import prediction_noise
from cspm_ident.signals.samples import Samples

Array = NDArray[np.float64]

# Healthy recordings of 6 s gave false alarms in 3 of 4, of 10 s and more in none: the last three
# tenths, which are held out, are then fewer than three blocks of a second.
_SHORTEST_S = 10.0
# A signal moves where its spread exceeds this many standard deviations of its noise.
_MOVES = 3.0
# Of the RMS speed: slower than that a shaft counts as standing, in `identify winch` as well.
_STANDING = 0.05
# From here on most rows say nothing of friction or inertia.
_MOSTLY = 0.5


def length_check(measurement: Measurement) -> DataCheck:
    """Return whether a recording lasts long enough for a hold-out of several blocks."""
    words = f"lasts {measurement.duration:.4g} s"
    found = [words] if measurement.duration < _SHORTEST_S else []
    remedy = f"record {_SHORTEST_S:g} s or more, or give another recording by --held-out"
    return check_of("length", measurement.path, found, words, remedy)


def excitation_check(measurement: Measurement) -> DataCheck:
    """Return whether every winch, and every pose that is measured, moves."""
    still = [f"{name} does not move" for name, column in _angles(measurement) if _still(column)]
    frame = measurement.frame_pose
    if frame is not None and not np.ptp(frame.values, axis=0).any():
        frame = None  # a constant, of a frame that is fixed
    for words, pose in (("the bar", measurement.bar_pose), ("the winch frame", frame)):
        if pose is not None and all(_still(pose.column(i)) for i in range(pose.values.shape[1])):
            still.append(f"{words} does not move")
    remedy = "what depends on this motion cannot be tested here"
    return check_of("excitation", measurement.path, still, "all that is measured moves", remedy)


def standstill_check(measurement: Measurement) -> DataCheck:
    """Return whether winches stand still for most of the time."""
    found = [
        f"{name} stands still for {100.0 * share:.0f} % of the time"
        for name, column in _angles(measurement)
        if not _still(column) and (share := standing_share(column)) > _MOSTLY
    ]
    remedy = "record more motion; standing rows say nothing of friction and are excluded"
    well = "no winch stands still for most of the time"
    return check_of("standstill", measurement.path, found, well, remedy)


def standing_share(angle: Samples) -> float:
    """Return the share of time in which a shaft is slower than 5 % of its RMS speed.

    Speeds are taken over ten samples, over which an encoder's steps average.
    """
    times, values = angle.times[::10], angle.values[::10, 0]
    apart = np.diff(times)
    if not len(apart):
        return 0.0
    speed = np.diff(values) / apart
    whole = np.sqrt(np.average(speed**2, weights=apart))
    return float(np.average(np.abs(speed) <= _STANDING * whole, weights=apart))


def _angles(measurement: Measurement) -> list[tuple[str, Samples]]:
    """Return the angles of winches that may move, by name."""
    if measurement.angle is None:
        return []
    return [
        (cable.name, measurement.angle.column(i))
        for i, cable in enumerate(measurement.machine.cables)
        if not cable.locked
    ]


def _still(column: Samples) -> bool:
    noise = np.sqrt(prediction_noise(column))
    return float(np.std(column.values)) <= _MOVES * float(noise)
