"""One cable between a winch and a fixed load cell, as a recording shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_ident.recording_hash import recording_sha256
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.attached_testbed import attached_testbed
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.testbed import Cable, Testbed, TestbedFile

Array = NDArray[np.float64]

WINCHES, TENSION = "/winches/state", "/cables/tension"
# A longer hole in the data than so many of its periods is no jitter.
LONGEST_GAP = 5.0


@dataclass(frozen=True)
class Specimen:
    """Equally spaced samples of one cable.

    Attributes:
        label: the cable's name; with the recording's before it where several share that name.
        recording: where it comes from.
        sha256: of the recording.
        cable: the cable in the test-bed file.
        distance: between its ends, m.
        time: of the samples, (n,) [s], on the recording's clock.
        wound: cable wound in since the first sample, (n,) [m].
        rate: cable wound in per second, (n,) [m/s].
        tension: measured, (n,) [N].
    """

    label: str
    recording: Path
    sha256: str
    cable: Cable
    distance: float
    time: Array
    wound: Array
    rate: Array
    tension: Array

    @property
    def length(self) -> float:
        """Elastic length of the cable while it is slack [m]."""
        return self.distance + self.cable.offset_length

    @property
    def period(self) -> float:
        """Time between samples [s]."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    @property
    def window(self) -> tuple[float, float]:
        """First and last instant [s]."""
        return float(self.time[0]), float(self.time[-1])


def read_specimens(
    recordings: Sequence[Path], testbed: TestbedFile | None = None, cables: Sequence[str] = ()
) -> list[Specimen]:
    """Return the cables of recordings of machines without bar, in the order of the test-beds.

    Args:
        recordings: one or more, each of one machine.
        testbed: the machine, instead of the one that each recording carries.
        cables: names of those wanted; all where none is named.

    Raises:
        InputError: no such recording or cable, a machine with bar, winches without load cells, or
            data with holes.
    """
    found = [one for path in recordings for one in _of_recording(path, testbed, cables)]
    missing = [name for name in cables if name not in {one.cable.name for one in found}]
    if missing:
        present = [one for path in recordings for one in _of_recording(path, testbed)]
        known = ", ".join(sorted({one.cable.name for one in present}))
        raise InputError(f"--cables {missing[0]}: no such cable, allowed: {known}")
    names = [one.cable.name for one in found]
    return [
        replace(one, label=f"{one.recording.name}:{one.label}")
        if names.count(one.cable.name) > 1
        else one
        for one in found
    ]


def with_stiffness(specimens: Sequence[Specimen], file: TestbedFile) -> list[Specimen]:
    """Return the specimens with the stiffness law that a test-bed file gives cables of their names.

    Raises:
        InputError: it has no such cable.
    """
    laws = {cable.name: cable.stiffness for cable in file.testbed.cables if cable.has_cable}
    for one in specimens:
        if one.cable.name not in laws:
            raise InputError(
                f"--stiffness: no cable {one.cable.name} in {file.testbed.name}, allowed: a"
                f" test-bed with it; it has {', '.join(laws)}"
            )
    return [
        replace(one, cable=one.cable.model_copy(update={"stiffness": laws[one.cable.name]}))
        for one in specimens
    ]


def recorded_testbed(path: Path) -> TestbedFile:
    """Return the test-bed that a recording carries.

    Raises:
        InputError: it carries none.
    """
    with Recording(path) as recording:
        return attached_testbed(recording.attachments, path)


def _of_recording(
    path: Path, given: TestbedFile | None, wanted: Sequence[str] = ()
) -> list[Specimen]:
    testbed = (given or recorded_testbed(path)).testbed
    _check_rig(path, testbed)
    with Recording(path) as recording:
        rows = recording.rows_of([WINCHES, TENSION])
        names = recording.topic(WINCHES).joint_names, recording.topic(TENSION).joint_names
    time, digest = _grid(path, rows), recording_sha256(path)
    return [
        _specimen(path, digest, cable, time, rows, names)
        for cable in testbed.cables
        if cable.has_cable and (not wanted or cable.name in wanted)
    ]


def _specimen(
    path: Path,
    digest: str,
    cable: Cable,
    time: Array,
    rows: dict[str, Rows],
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> Specimen:
    """Return one cable; `names` are those of winches and load cells, in the order of columns."""
    if not all(cable.name in group for group in names):
        raise InputError(
            f"{path}: {cable.name} not in {WINCHES} and {TENSION}, allowed: a recording of the"
            " test-bed's cables"
        )
    winch, cell = (group.index(cable.name) for group in names)
    radius = cable.wound_radius
    angle = _at(time, rows[WINCHES], winch)
    return Specimen(
        label=cable.name,
        recording=path,
        sha256=digest,
        cable=cable,
        distance=_distance(cable),
        time=time,
        wound=radius * (angle - angle[0]),
        rate=radius * _at(time, rows[WINCHES], len(names[0]) + winch),
        tension=_at(time, rows[TENSION], cell),
    )


def _check_rig(path: Path, testbed: Testbed) -> None:
    if testbed.bar is not None or testbed.winch_frame is not None:
        raise InputError(
            f"{path}: {testbed.name} has a bar or a winch frame, allowed: cables fixed in the world"
        )
    bent = [cable.name for cable in testbed.cables if not cable.is_straight]
    if bent:
        raise InputError(
            f"{path}: {bent[0]} has a pulley or several parts, allowed: straight cables of one part"
        )
    if not any(cable.has_cable for cable in testbed.cables):
        raise InputError(f"{path}: {testbed.name} has winches alone, allowed: winches with cables")


def _distance(cable: Cable) -> float:
    return float(np.linalg.norm(np.subtract(cable.attachment or 0.0, cable.exit or 0.0)))


def _grid(path: Path, rows: dict[str, Rows]) -> Array:
    """Return equally spaced instants [s] that all topics cover, at the rate of the slowest."""
    stamps = {name: found.stamp_ns * 1e-9 for name, found in rows.items()}
    for name, times in stamps.items():
        if len(times) < 2 or (np.diff(times) <= 0.0).any():
            raise InputError(f"{path}: {name}, allowed: at least two messages in order of stamps")
        steps = np.diff(times)
        i = int(np.argmax(steps))
        if steps[i] > LONGEST_GAP * np.median(steps):
            raise InputError(
                f"{path}: {name}: a gap of {steps[i]:.3g} s at {times[i]:.3f} s, allowed: at most"
                f" {LONGEST_GAP * np.median(steps):.3g} s"
            )
    period = max(float(np.median(np.diff(times))) for times in stamps.values())
    start = max(times[0] for times in stamps.values())
    end = min(times[-1] for times in stamps.values())
    count = int((end - start) / period + 1e-6) + 1
    if count < 2:
        raise InputError(f"{path}: {WINCHES} and {TENSION} share no time, allowed: both at once")
    grid: Array = start + period * np.arange(count)
    return grid


def _at(time: Array, rows: Rows, column: int) -> Array:
    """Return a column at the instants, on straight lines between the stamps."""
    return np.interp(time, rows.stamp_ns * 1e-9, rows.rows[:, column])
