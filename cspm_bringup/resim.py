"""Repeating a run from its recording alone."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from cspm_bringup.bundle import read_bundle
from cspm_bringup.run import RECORD_NAME, run
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.difference import Difference, first_difference
from cspm_msgs_py.recording.reader import Recording


@dataclass(frozen=True)
class Resimulation:
    """How a repeated run compares.

    Attributes:
        difference: the first place where it differs, None if every message is identical.
        messages: how many messages were compared.
        recorded_version: version of the package that made the recording.
    """

    difference: Difference | None
    messages: int
    recorded_version: str

    @property
    def same_version(self) -> bool:
        """Whether the package that made the recording is this one."""
        return self.recorded_version == version("cspm")


def resimulate(path: Path, progress: Callable[[float, float], None]) -> Resimulation:
    """Run again what a recording says it ran, for as long as it lasts, and compare.

    Args:
        path: the recording.
        progress: called with simulated and total time [s].

    Raises:
        InputError: no recording, or none that cspm made by simulation.
    """
    recording = Recording(path)
    bundle = read_bundle(recording.attachments, str(path))
    clock = recording.topics.get("/clock")
    if clock is None or not clock.count:
        raise InputError(f"{path}: has no /clock messages, allowed: a simulated recording")
    duration = clock.count / bundle.scenario.rates.plant
    with tempfile.TemporaryDirectory(prefix="cspm-resim-") as place:
        folder = Path(place) / "again"
        run(bundle, folder, lambda now: progress(now, duration), steps=clock.count)
        difference = first_difference(recording, Recording(folder))
    return Resimulation(
        difference=difference,
        messages=sum(topic.count for topic in recording.topics.values()),
        recorded_version=recording.metadata.get(RECORD_NAME, {}).get("package_version", "unknown"),
    )
