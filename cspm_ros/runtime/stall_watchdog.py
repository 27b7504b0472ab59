"""Looks at a run now and then: tells what it waits for, in lockstep loses patience."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

PATIENCE_S = 30.0
COMPLAIN_S = 5.0
LOOK_EVERY_S = 0.1
STANDSTILL = "nothing moved"
# How long a start may take before it is told what it waits for.
GRACE_S = 3.0


class Waiting(Protocol):
    """A node that says how far it is, and what it waits for."""

    @property
    def progress(self) -> int:
        """The plant step through which it is complete."""

    def waiting(self) -> str:
        """Return what has to come before it goes on."""


class Watch:
    """Watches nodes of this process.

    Attributes:
        elapsed: wall time from the first step to the last look at which something moved [s].
        stuck: why the run is given up, if it is.
    """

    def __init__(
        self, nodes: Sequence[Waiting], patience_s: float, complain: Callable[[str], None]
    ) -> None:
        """Take the nodes, how long they may stand still, and whom to tell what they wait for."""
        self._nodes = nodes
        self._patience_s = patience_s
        self._complain = complain
        self._state: tuple[int, ...] = ()
        self._began: float | None = None
        self._moved = self._complained = time.perf_counter()
        self.stuck: str | None = None

    @property
    def elapsed(self) -> float:
        """Wall time since the first step [s]."""
        return self._moved - self._began if self._began is not None else 0.0

    def look(self) -> None:
        """Note what moved since the last look."""
        now = time.perf_counter()
        state = tuple(node.progress for node in self._nodes)
        if state != self._state:
            self._state, self._moved, self._complained = state, now, now
            if self._began is None and max(state) > 0:
                self._began = now
            return
        if now - self._complained >= COMPLAIN_S:
            self._complained = now
            self._complain(f"since {now - self._moved:.0f} s {self.waiting()}")
        if now - self._moved > self._patience_s:
            self.stuck = f"{STANDSTILL} for {self._patience_s:g} s: {self.waiting()}"

    def waiting(self) -> str:
        """Return what the nodes wait for."""
        return "; ".join(node.waiting() for node in self._nodes)


class StartWatch:
    """Tells what a run waits for before it begins, when that changes."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        """Take whom to tell."""
        self._tell, self._told = tell, ""
        self._began = time.monotonic()

    def look(self, waiting: str) -> None:
        """Take what it waits for now, in one line; empty if for nothing."""
        waits = waiting if time.monotonic() - self._began > GRACE_S else ""
        if waits != self._told:
            self._told = waits
            self._tell(waits)
