"""Looks at a lockstep run now and then: shows progress, passes a stop on, loses patience."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

PATIENCE_S = 30.0
COMPLAIN_S = 5.0
LOOK_EVERY_S = 0.1
STANDSTILL = "nothing moved"


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
