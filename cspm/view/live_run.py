"""A run that is watched: what is recorded of it so far, and what its watchers ask of it."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cspm.view.frames import Frames, frames_of
from cspm.view.growing import GrowingRecording
from cspm.view.knobs import PACE, Knob
from cspm.view.viewer_page import packed
from cspm_msgs_py.errors import InputError

PAUSE = "pause"
# How long a run that waits for the clock sleeps at a time [s].
_NAP_S = 0.05
# A reading of the recording may take this share of the time between two.
_BUSY_SHARE = 0.25


class Restart(Exception):
    """A knob was turned: the run begins again."""


class LiveRun:
    """What the run's thread and those of the server share.

    Attributes:
        knobs: as they are set.
        can_pause: whether the run waits when it is asked to.
    """

    def __init__(self, knobs: Sequence[Knob], *, can_pause: bool) -> None:
        """Take what may be turned."""
        self.knobs, self.can_pause = list(knobs), can_pause
        self._changed = threading.Condition()
        self._reading = threading.Lock()
        self._folder, self._generation = Path(), 0
        self._paused = self._ended = self._turned = False
        self._due = self._simulated = 0.0
        self._frames: Frames | None = None
        self._recording: GrowingRecording | None = None
        self._readings, self._next_reading = 0, 0.0

    def begin(self, folder: Path) -> None:
        """Watch a recording that is about to be made."""
        with self._changed:
            self._folder, self._generation = folder, self._generation + 1
            self._ended = self._turned = False
            self._due, self._simulated = time.monotonic(), 0.0
            self._frames, self._recording = None, GrowingRecording(folder)
            self._next_reading = 0.0

    def hold(self, simulated: float) -> None:
        """Wait until the clock has come to the time simulated so far [s], and while paused.

        Raises:
            Restart: a knob was turned.
            KeyboardInterrupt: Ctrl-C while it is paused.
        """
        with self._changed:
            self._due += (simulated - self._simulated) / self._pace
            self._simulated = simulated
            while not self._turned and (self._paused or time.monotonic() < self._due):
                with _heard(self._paused):
                    self._changed.wait(_NAP_S)
                if self._paused:
                    self._due = time.monotonic()
            if self._turned:
                raise Restart

    def end(self) -> None:
        """Note that the run has ended."""
        with self._changed:
            self._ended, self._next_reading = True, 0.0

    def wait(self, stopped: Callable[[], bool]) -> None:
        """Wait until a knob is turned, or it is to end."""
        with self._changed:
            while not self._turned and not stopped():
                self._changed.wait(_NAP_S)

    def turn(self, name: str, value: object) -> None:
        """Do what somebody asks for.

        Raises:
            InputError: no such knob, or a value that it cannot have.
        """
        with self._changed:
            if name == PAUSE and self.can_pause and isinstance(value, bool):
                self._paused = value
            else:
                names = [each.name for each in self.knobs]
                if name not in names:
                    raise InputError(f"{name}: no knob, allowed: {', '.join((PAUSE, *names))}")
                place = names.index(name)
                self.knobs[place] = self.knobs[place].at(value)
                # The pace is no part of the machine.
                self._turned = self._turned or name != PACE
                self._paused = self._paused and name == PACE
            self._changed.notify_all()

    def answer(self, after: str) -> bytes | None:
        """Return as JSON what is new since a version, None where nothing is."""
        frames = self.frames()
        version = f"{self._generation}-{self._readings}-{self._paused}-{self._ended}"
        if version == after:
            return None
        heads, numbers = packed([frames] if frames else [])
        data = {"version": version, "runs": heads, "numbers": numbers, "state": self._state()}
        return json.dumps(data).encode()

    @property
    def _pace(self) -> float:
        return next((float(each.value) for each in self.knobs if each.name == PACE), float("inf"))

    def _state(self) -> dict[str, Any]:
        return {
            "paused": self._paused,
            "ended": self._ended,
            "can_pause": self.can_pause,
            "knobs": [each.data() for each in self.knobs],
        }

    def frames(self) -> Frames | None:
        """Return the frames of the recording so far; one that grows is read on now and then."""
        with self._reading:
            begun, recording = time.monotonic(), self._recording
            # One that is paused is looked at often: it grows no more, and shows its end at once.
            if recording is None or (begun < self._next_reading and not self._paused):
                return self._frames
            try:
                if not recording.update():
                    return self._frames
                found = frames_of(recording, self._folder.name)
            except (InputError, IndexError):
                # Not there yet, or without a message that could be shown.
                return self._frames
            if recording is self._recording:
                self._frames, self._readings = found, self._readings + 1
                took = time.monotonic() - begun
                self._next_reading = begun + took / _BUSY_SHARE
            return self._frames


@contextmanager
def _heard(wanted: bool) -> Iterator[None]:
    """Let Ctrl-C interrupt what waits, where a run that makes no steps would not look at it."""
    if not wanted or threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
