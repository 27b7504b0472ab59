"""Recordings as a script handles them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from cspm.progress import Progress, shows_progress, silent
from cspm.signals import Signals
from cspm.testbed import Testbed
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import (
    Difference,
    Overview,
    RecoveryReport,
    Rows,
    first_difference,
    overview,
)
from cspm_msgs_py.recording import Recording as Reader
from cspm_msgs_py.recording import recover as recover_recording
from cspm_msgs_py.recording.attached_testbed import TESTBED, attached_testbed
from cspm_msgs_py.topics import Topic
from cspm_run.resim import Resimulation, resimulate


class Recording(Signals):
    """A recording on disk; its signals are read when they are asked for.

    Examples:
        >>> import cspm
        >>> recording = cspm.open("calm_30")  # doctest: +SKIP
        >>> recording.tension["sway_3"].mean()  # doctest: +SKIP
        8.3

    Attributes:
        path: its folder or MCAP file.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a recording; see `cspm.open`.

        Raises:
            InputError: missing, damaged beyond use, or not stored as MCAP.
        """
        self.path = Path(path)
        with Reader(self.path) as reader:
            self._counts = {name: info.count for name, info in reader.topics.items()}
            self._span = reader.start_ns, reader.end_ns
            self.attachments: Mapping[str, bytes] = reader.attachments
            self.metadata: Mapping[str, Mapping[str, str]] = reader.metadata
            self.complete = reader.complete
            self.left_out = reader.left_out
        self._found: dict[str, tuple[Topic, Rows]] = {}

    @property
    def duration(self) -> float:
        """Time from the first message to the last [s]."""
        return (self._span[1] - self._span[0]) * 1e-9

    @cached_property
    def testbed(self) -> Testbed:
        """The machine that the recording carries.

        Raises:
            InputError: it carries none.
        """
        if TESTBED not in self.attachments:
            raise InputError(f"{self.path}: carries no {TESTBED}, allowed: a recording with one")
        return Testbed(attached_testbed(self.attachments, self.path))

    def overview(self) -> Overview:
        """Return topics with rates [Hz] and longest gaps, duration, origin: `cspm info`."""
        return overview(self.path)

    @staticmethod
    def recover(path: str | Path, out: str | Path | None = None) -> RecoveryReport:
        """Restore a recording whose writer was killed, with its index and metadata.

        Args:
            path: of the recording.
            out: a new folder to write to; None: in place, and the original is kept as `….broken`.

        Raises:
            InputError: it cannot be read, or the new folder exists.
        """
        return recover_recording(Path(path), None if out is None else Path(out))

    @shows_progress("repeating")
    def resimulate(
        self, progress: Progress = silent, *, controllers: Sequence[str | Path] = ()
    ) -> Resimulation:
        """Repeat the run from the recording alone; `difference` is None where it is identical.

        Args:
            progress: called now and then with the share that is done.
            controllers: your own copies of the controllers' files that its scenario named; what a
                recording carries of code is never run.

        Raises:
            InputError: it is no simulation by cspm with the controllers of its scenario, or took
                a controller of which there is no copy.
        """
        own = [Path(each) for each in controllers]
        return resimulate(self.path, lambda now, total: progress(now / total, "repeating"), own)

    def difference(self, other: Recording) -> Difference | None:
        """Return the first place where the messages of two recordings differ, or None.

        Raises:
            InputError: one of them cannot be read.
        """
        with Reader(self.path) as own, Reader(other.path) as its:
            return first_difference(own, its)

    def _topics(self) -> tuple[str, ...]:
        return tuple(name for name, count in self._counts.items() if count)

    def _start_ns(self) -> int:
        return self._span[0]

    def _read(self, name: str) -> tuple[Topic, Rows]:
        if name not in self._found:
            with Reader(self.path) as reader:
                rows = reader.rows(name)
                self._found[name] = reader.topic(name), rows
        return self._found[name]

    @property
    def _label(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"Recording({str(self.path)!r}, {self.duration:g} s)"


AnyRecording: TypeAlias = Recording | str | Path


def open(path: str | Path) -> Recording:
    """Open a recording: by this project or by others, closed or killed.

    Args:
        path: of a rosbag2 folder with MCAP files, or of one MCAP file. Other formats are converted
            by `cspm import`.

    Raises:
        InputError: missing, damaged beyond use, or not stored as MCAP.
    """
    return Recording(path)


def path_of(recording: AnyRecording) -> Path:
    """Return the path of what a caller may give as a recording."""
    return recording.path if isinstance(recording, Recording) else Path(recording)
