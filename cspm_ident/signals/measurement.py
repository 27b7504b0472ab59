"""A recording's measured signals; never the truth that a simulation records beside them."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.recording_hash import recording_sha256
from cspm_ident.signals.samples import Samples, ordered
from cspm_model.kernels.trajectory import eulers_along
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.attached_testbed import attached_testbed
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.recording.run_record import simulated_plant
from cspm_msgs_py.testbed import Testbed, TestbedFile, load_testbed
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]

FRAME, BAR, WINCHES, TENSION = (
    "/winch_frame/pose",
    "/bar/pose",
    "/winches/state",
    "/cables/tension",
)
COMMAND = "/winches/torque_command"
WANTED = ("/bar/reference", "/winch_frame/reference")
# Further parts of `/winches/state`, which count as sensors of their own.
# Plans are smooth.
_WANTED_EVERY_S = 0.005
SPEED, TORQUE = "/winches/state velocity", "/winches/state effort"


@dataclass(frozen=True, eq=False)
class Measurement:
    """What was measured on one machine. Absent sensors are None.

    Attributes:
        path: the recording.
        sha256: of its MCAP files, in order.
        testbed: the machine as it was described.
        frame_pose, bar_pose: x y z φ θ ψ in world_ned [m, rad], angles without jumps.
        angle, speed, torque: at the motor shafts [rad, rad/s, N·m], one column per cable.
        tension: [N], one column per cable.
        command: commanded torque [N·m].
        wanted: wanted pose, twist and acceleration, of the bar and of the winch frame, (n, 38),
            where both are recorded.
        torque_age: how long before its stamp the reported torque acted, on average [s]. A simulated
            drive reports what it held since the stamp before: half a period. Of others nothing is
            known, and 0 is taken.
        complete: whether whatever wrote the recording closed it.
        left_out: lines about messages with impossible log times.
        assumed: a machine that is assumed instead of the described one; None: the described one.
    """

    path: Path
    sha256: str
    testbed: TestbedFile
    frame_pose: Samples | None = None
    bar_pose: Samples | None = None
    angle: Samples | None = None
    speed: Samples | None = None
    torque: Samples | None = None
    tension: Samples | None = None
    command: Samples | None = None
    wanted: Samples | None = None
    torque_age: float = 0.0
    complete: bool = True
    left_out: tuple[str, ...] = ()
    assumed: Testbed | None = None

    @property
    def machine(self) -> Testbed:
        """The machine as it was described, or as it is assumed to be."""
        return self.testbed.testbed if self.assumed is None else self.assumed

    @property
    def sensors(self) -> dict[str, Samples]:
        """The sensors that there are, by topic; of `/winches/state` the angle or what there is."""
        winches = next((s for s in (self.angle, self.speed, self.torque) if s is not None), None)
        found = {
            FRAME: self.frame_pose,
            BAR: self.bar_pose,
            WINCHES: winches,
            TENSION: self.tension,
        }
        return {name: samples for name, samples in found.items() if samples is not None}

    @property
    def _parts(self) -> dict[str, Any]:
        """What was measured, by attribute."""
        names = ("frame_pose", "bar_pose", "angle", "speed", "torque", "tension", "command")
        parts = {name: getattr(self, name) for name in names}
        return {name: samples for name, samples in parts.items() if samples is not None}

    @property
    def knows_frame(self) -> bool:
        """Whether the winch frame's pose is known: measured, or fixed as no sensor is listed."""
        return self.frame_pose is not None or FRAME not in self.machine.sensors

    @property
    def duration(self) -> float:
        """Time of the last sample of all sensors [s]."""
        return max((float(s.times[-1]) for s in self.sensors.values()), default=0.0)

    def with_samples(self, name: str, samples: Samples) -> Measurement:
        """Return the same with other samples of one sensor, by attribute name."""
        changed: dict[str, Any] = {name: samples}
        return replace(self, **changed)

    def within(self, start: float, end: float) -> Measurement:
        """Return what was measured from `start` to `end` [s]."""
        return replace(self, **{n: s.within(start, end) for n, s in self._parts.items()})

    def since(self, start: float) -> Measurement:
        """Return what was measured from `start` [s] on; of the same samples at every call."""
        return replace(self, **{n: s.since(start) for n, s in self._parts.items()})

    def without(self, start: float, end: float) -> Measurement:
        """Return what was measured outside `start` to `end` [s], where each sensor has a hole."""
        parts = self._parts if self.wanted is None else {**self._parts, "wanted": self.wanted}
        return replace(self, **{n: s.without(start, end) for n, s in parts.items()})

    def with_testbed(self, testbed: TestbedFile) -> Measurement:
        """Return the same, said to be of another description of the machine."""
        return replace(self, testbed=testbed, assumed=None)

    def with_machine(self, machine: Testbed) -> Measurement:
        """Return the same, its machine assumed to be another than the described one."""
        return replace(self, assumed=machine)


def read_measurement(path: Path, testbed: Path | TestbedFile | None = None) -> Measurement:
    """Read what a recording measured.

    Args:
        path: the recording.
        testbed: the machine or its file, instead of the one that the recording carries.

    Raises:
        InputError: no recording, no test-bed, other cables than the test-bed's, or no samples.
    """
    with ThreadPoolExecutor(1) as pool, Recording(path) as recording:
        digest = pool.submit(recording_sha256, path)
        machine = _described(recording, testbed)
        topics = machine.testbed.topics
        wanted = (FRAME, BAR, WINCHES, TENSION, COMMAND)
        names = [n for n in wanted if n in topics and _count(recording, n)]
        reference_topics = WANTED if all(_count(recording, n) for n in WANTED) else ()
        rows = recording.rows_of([*names, *reference_topics])
        found = {name: recording.topic(name) for name in names}
        simulated = simulated_plant(recording) is not None
        closed, left_out = recording.complete, tuple(recording.left_out)
    if not names:
        raise InputError(f"{path}: no measured topic, allowed: at least one of {', '.join(wanted)}")
    _check_cables(found, machine.testbed, path)
    start = min(int(rows[name].stamp_ns.min()) for name in names)
    parts: dict[str, Samples] = {}
    for name in names:
        parts.update(_samples(name, found[name], rows[name], start, machine.testbed))
    parts.update(_locked(parts, machine.testbed))
    torque = parts.get("torque")
    age = 0.5 * torque.interval if simulated and torque is not None else 0.0
    # mypy takes `parts` for every argument that is not given.
    return Measurement(
        path,
        digest.result(),
        machine,
        **parts,
        wanted=_wanted(rows, start) if reference_topics else None,
        torque_age=age,
        complete=closed,
        left_out=left_out,
        assumed=None,
    )


def _described(recording: Recording, testbed: Path | TestbedFile | None) -> TestbedFile:
    if testbed is None:
        return attached_testbed(recording.attachments, recording.path)
    return load_testbed(testbed) if isinstance(testbed, Path) else testbed


def _count(recording: Recording, name: str) -> int:
    return recording.topics[name].count if name in recording.topics else 0


def _check_cables(found: dict[str, Topic], machine: Testbed, path: Path) -> None:
    for name, topic in found.items():
        if topic.joint_names and set(topic.joint_names) != set(machine.cable_names):
            raise InputError(
                f"{path}: {name}: cables {', '.join(topic.joint_names)}, allowed: the test-bed's,"
                f" {', '.join(machine.cable_names)}"
            )


def _samples(
    name: str, topic: Topic, rows: Rows, start_ns: int, machine: Testbed
) -> dict[str, Samples]:
    times = np.asarray((rows.stamp_ns - start_ns) * 1e-9, dtype=np.float64)
    if name in (FRAME, BAR):
        found = ordered(times, _euler(rows.rows))
        found.values[:, 3:] = np.unwrap(found.values[:, 3:], axis=0)
        return {"frame_pose" if name == FRAME else "bar_pose": found}
    kinds = {WINCHES: {"position": "angle", "velocity": "speed", "effort": "torque"}}
    kinds[TENSION], kinds[COMMAND] = {"effort": "tension"}, {"effort": "command"}
    out: dict[str, Samples] = {}
    for part, kind in kinds[name].items():
        if part in topic.parts:
            columns = [topic.fields.index(f"{part}/{cable}") for cable in machine.cable_names]
            found = ordered(times, rows.rows[:, columns])
            same = (s for s in out.values() if np.array_equal(s.times, found.times))
            beside = next(same, None)
            out[kind] = found if beside is None else beside.of_others(found.values)
    return {kind: samples for kind, samples in out.items() if len(samples.times)}


def _locked(parts: Mapping[str, Samples], machine: Testbed) -> dict[str, Samples]:
    """Return the angles and speeds of a machine with locked winches: constant, and 0.

    Where all are locked, no angle need be recorded.
    """
    locked = np.array([cable.locked for cable in machine.cables])
    beside = next((parts[n] for n in ("tension", "bar_pose", "frame_pose") if n in parts), None)
    if "angle" not in parts and locked.all() and beside is not None:
        return {"angle": Samples(beside.times, np.zeros((len(beside.times), len(locked))))}
    found = {}
    for name in ("angle", "speed"):
        if name in parts and locked.any():
            values = parts[name].values.copy()
            values[:, locked] = values[:1, locked] if name == "angle" else 0.0
            found[name] = Samples(parts[name].times, values)
    return found


def _wanted(rows: Mapping[str, Rows], start_ns: int) -> Samples:
    """Return the references of bar and frame, at the bar's times, thinned out."""
    bar, frame = (rows[name] for name in WANTED)
    times = np.asarray((bar.stamp_ns - start_ns) * 1e-9, dtype=np.float64)
    step = max(1, int(_WANTED_EVERY_S * len(times) / max(float(np.ptp(times)), _WANTED_EVERY_S)))
    times = times[::step]
    other = (frame.stamp_ns - start_ns) * 1e-9
    beside = [np.interp(times, other, column) for column in frame.rows.T]
    return ordered(times, np.column_stack([bar.rows[::step], *beside]))


def _euler(rows: Array) -> Array:
    """Return x y z φ θ ψ, (n, 6), of pose rows (n, 7)."""
    out = np.empty((len(rows), 6))
    out[:, :3] = rows[:, :3]
    eulers_along(rows[:, 3:], out[:, 3:])
    return out
