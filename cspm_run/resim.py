"""Repeating a run from its recording alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import hardware_id_of
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.difference import Difference, first_difference
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.run_record import (
    OWN_NODE,
    RECORD_NAME,
    SIM,
    own_controllers,
    simulated_plant,
)
from cspm_msgs_py.topics import DIAGNOSTICS, SCENE
from cspm_run.bundle import read_bundle, with_own_code
from cspm_run.recorded_run import run, steps_of


@dataclass(frozen=True)
class Resimulation:
    """How a repeated run compares.

    Attributes:
        difference: the first place where it differs, None if every message is identical.
        messages: how many messages the recording holds.
        cut_ns: the instant inside which the recording ends [ns], None if its last is whole.
        recorded_version: version of the package that made the recording.
        missing_s: first and last time [s] of each part of the scenario that is not recorded.
    """

    difference: Difference | None
    messages: int
    cut_ns: int | None
    recorded_version: str
    missing_s: tuple[tuple[float, float], ...] = ()

    @property
    def same_version(self) -> bool:
        """Whether the package that made the recording is this one."""
        return self.recorded_version == version("cspm")


def resimulate(
    path: Path,
    progress: Callable[[float, float], None],
    controllers: Sequence[Path] = (),
) -> Resimulation:
    """Repeat the run that a recording describes, for as long as it lasts, and compare.

    Args:
        path: the recording.
        progress: called with simulated and total time [s].
        controllers: the user's own copies of the controllers' files that took part.

    Raises:
        InputError: no recording, or none that cspm made by simulation; or controllers took part of
            which `controllers` has no copy.
    """
    with Recording(path) as recording:
        return _repeat(recording, path, progress, controllers)


def _repeat(
    recording: Recording,
    path: Path,
    progress: Callable[[float, float], None],
    controllers: Sequence[Path],
) -> Resimulation:
    record = recording.metadata.get(RECORD_NAME, {})
    plant = simulated_plant(recording) or SIM
    bundle = replace(read_bundle(recording.attachments, str(path)), plant=plant)
    own = own_controllers(recording)
    if own is not None and (OWN_NODE in own or not bundle.scenario.controllers):
        raise InputError(
            f"{path}: was made with controllers that it does not carry ({own}), allowed: one made"
            " with those of its scenario"
        )
    bundle = with_own_code(bundle, controllers)
    clock = recording.topics.get("/clock")
    if clock is None or not clock.count:
        raise InputError(f"{path}: has no /clock messages, allowed: a simulated recording")
    duration = clock.count / bundle.scenario.rates.plant
    with ScratchFolder("resim") as place:
        folder = place / "again"
        result = run(
            bundle,
            folder,
            lambda now: progress(now, duration),
            steps=clock.count,
            hardware_id=_hardware_id(recording),
        )
        with Recording(folder) as repeated:
            difference, cut = _compared(recording, repeated)
    return Resimulation(
        difference=None if cut else difference,
        messages=sum(topic.count for topic in recording.topics.values()),
        cut_ns=recording.end_ns if cut else None,
        recorded_version=record.get("package_version", "unknown"),
        missing_s=_missing(
            recording.rows("/clock").stamp_ns / NANOSECONDS * bundle.scenario.rates.plant,
            steps_of(bundle) if result.failure is None else clock.count,
            bundle.scenario.rates.plant,
        ),
    )


def _missing(
    instants: NDArray[np.float64], steps: int, rate: float
) -> tuple[tuple[float, float], ...]:
    """Return first and last time [s] of each part of a run of so many steps that is not there.

    Args:
        instants: recorded ones, in steps of the plant.
        steps: how many the run has.
        rate: steps per second [Hz].
    """
    edges = np.unique(np.r_[-1.0, np.round(instants), steps])
    gaps = np.flatnonzero(np.diff(edges) > 1.0)
    return tuple(
        (float(edges[i] + 1.0) / rate, float(edges[i + 1] - 1.0) / rate) for i in gaps.tolist()
    )


def _hardware_id(recording: Recording) -> str | None:
    """Return the name that statuses of a recording give the machine; older ones have none."""
    if DIAGNOSTICS.name not in recording.topics:
        return None
    payloads = recording.payloads(DIAGNOSTICS.name).payloads
    return hardware_id_of(payloads[0]) if payloads else None


def _compared(recording: Recording, repeated: Recording) -> tuple[Difference | None, bool]:
    """Return where two recordings first differ, and whether it is only that the first was cut."""
    # The scene follows from blocks of the rest. Older recordings have none.
    absent = [name for name in SCENE if name not in recording.topics]
    found = first_difference(recording, repeated, but=absent)
    if found is not None and found.topic in SCENE:
        found = first_difference(recording, repeated, but=SCENE) or found
    return found, found is not None and _is_cut(recording, repeated, found)


def _is_cut(recording: Recording, repeated: Recording, difference: Difference) -> bool:
    """Return whether the difference is only that the recording ends inside its last instant.

    Messages of one instant are written in one order, so what a cut leaves of it comes first. The
    difference is the earliest, so that nothing before that instant is missing.
    """
    if (difference.field, difference.first) != ("message", "missing"):
        return False
    (last_ns, left), (whole_ns, whole) = _last_instant(recording), _last_instant(repeated)
    at_end = difference.index == repeated.topics[difference.topic].count - 1
    follows = left == whole[: len(left)] and difference.topic in whole[len(left) :]
    return last_ns == whole_ns and at_end and follows


def _last_instant(recording: Recording) -> tuple[int, list[str]]:
    """Return the last log time [ns] and the topics of its messages, as they were written."""
    file = recording.files[-1]
    messages = file.messages(file.chunks[-1])
    last = messages.logs == messages.logs.max()
    found = [file.topic_of(channel) for channel in messages.channels[last].tolist()]
    topics = [name for name in found if name not in SCENE]
    return int(messages.logs.max()), topics
