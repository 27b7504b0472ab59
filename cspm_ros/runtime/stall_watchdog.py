"""Looks at a run now and then: says what it waits for, in lockstep loses patience.

A run starts until every node has gone on beyond `FIRST_STEPS`: it loads libraries, compiles, waits
for all nodes to join, and compiles again in the first steps. Patience counts from then on. What a
start may take depends on the machine; what this process took until it could join is a measure of
it. Measured on two crowded cores with nothing compiled: every node could join after 20 to 78 s, and
then the longest wait for another node's compilation was 45 s, so that ten times the larger of own
cost and patience leaves room for nodes that need several times as long as this one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.stepping.lockstep import RECORDER_WINDOW

PATIENCE_S = 30.0
LEAST_PATIENCE_S = 0.1
COMPLAIN_S = 5.0
LOOK_EVERY_S = 0.1
STANDSTILL = "nothing moved"
# How long a start may take before what it waits for is reported.
GRACE_S = 3.0
# A start may take so many times the longer of patience and its own cost.
START_FACTOR = 10.0
# The plant is that far ahead of nobody: whoever is beyond has met all others at work.
FIRST_STEPS = RECORDER_WINDOW


def check_patience(seconds: float) -> float:
    """Return a patience [s] that was given as an option.

    Raises:
        InputError: it is not finite, or too short.
    """
    if not LEAST_PATIENCE_S <= seconds < math.inf:
        raise InputError(f"--patience {seconds:g}: allowed: {LEAST_PATIENCE_S:g} s or more, finite")
    return seconds


@dataclass(frozen=True)
class Patience:
    """How long a run may stand still.

    Attributes:
        seconds: once it is under way [s].
        cost: wall time that this process took until it could join [s].
    """

    seconds: float = PATIENCE_S
    cost: float = 0.0

    @property
    def start(self) -> float:
        """How long the start may stand still [s]."""
        return START_FACTOR * max(self.seconds, self.cost)

    def late(self, joined: bool, waiting: str) -> str:
        """Return in one line why a start is given up."""
        what = "the first steps stood still for" if joined else "not all nodes joined within"
        return (
            f"{what} {round(self.start, 1):g} s: {waiting}; allowed: {START_FACTOR:g} times the"
            f" longer of patience ({self.seconds:g} s) and what this start cost ({self.cost:.1f} s)"
            "; for more use --patience SECONDS, for a node the parameter patience"
        )


class Waiting(Protocol):
    """A node that says how far it is, and what it waits for."""

    @property
    def progress(self) -> int:
        """The plant step through which it is complete, −1 before the first."""

    def waiting(self) -> str:
        """Return what has to come before it goes on."""


class Watch:
    """Watches nodes of this process.

    Attributes:
        elapsed: wall time from the first step to the last look at which something moved [s].
        stuck: why the run is given up, if it is.
    """

    def __init__(
        self,
        nodes: Sequence[Waiting],
        patience: Patience,
        complain: Callable[[str], None],
        *,
        guarded: bool = False,
    ) -> None:
        """Watch nodes.

        Args:
            nodes: of this process.
            patience: how long they may stand still.
            complain: called with what they wait for.
            guarded: whether another process says what is missing before the first step, and ends
                a start that takes too long.
        """
        self._nodes = nodes
        self._patience = patience
        self._complain = complain
        self._guarded = guarded
        self._state: tuple[int, ...] = ()
        self._under_way = False
        self._began: float | None = None
        self._moved = self._complained = time.perf_counter()
        self.stuck: str | None = None

    @property
    def cost(self) -> float:
        """Wall time that this process took until it could join [s]."""
        return self._patience.cost

    @property
    def elapsed(self) -> float:
        """Wall time since the first step [s]."""
        return self._moved - self._began if self._began is not None else 0.0

    def rest(self) -> None:
        """Count from now: so far nobody had to move."""
        self._moved = self._complained = time.perf_counter()

    def look(self) -> None:
        """Note what moved since the last look."""
        now = time.perf_counter()
        state = tuple(node.progress for node in self._nodes)
        if state != self._state:
            # A slow controller is beyond the first steps with its first one, so the next counts.
            self._under_way |= min(self._state, default=-1) > FIRST_STEPS
            self._state, self._moved, self._complained = state, now, now
            if self._began is None and max(state) > 0:
                self._began = now
        elif max(state) >= 0 or not self._guarded:
            self._judge(now - self._moved, now)

    def _judge(self, still: float, now: float) -> None:
        """Complain of a standstill of so long [s], or give up."""
        if now - self._complained >= COMPLAIN_S:
            self._complained = now
            self._complain(f"since {still:.0f} s {self.waiting()}")
        if self._under_way:
            if still > self._patience.seconds:
                self.stuck = f"{STANDSTILL} for {self._patience.seconds:g} s: {self.waiting()}"
        elif still > self._patience.start:
            self.stuck = self._patience.late(max(self._state) >= 0, self.waiting())

    def waiting(self) -> str:
        """Return what the nodes wait for."""
        return "; ".join(node.waiting() for node in self._nodes)


class StartWatch:
    """Tells what a run waits for before it begins, when that changes; gives up if for too long.

    Attributes:
        stuck: why the start is given up, if it is.
    """

    def __init__(self, notify: Callable[[str], None], patience: Patience) -> None:
        """Take what gets each line, and how long it may take; infinite patience never gives up."""
        self._notify, self._reported = notify, ""
        self._patience = patience
        self._began = time.monotonic()
        self.stuck: str | None = None

    @property
    def elapsed(self) -> float:
        """Wall time since the watch began [s]."""
        return time.monotonic() - self._began

    def note_cost(self) -> None:
        """Take the time since the watch began for what starting costs, the first time."""
        if not self._patience.cost:
            self._patience = replace(self._patience, cost=self.elapsed)

    def look(self, waiting: str) -> None:
        """Take what it waits for now, in one line; empty if for nothing."""
        passed = self.elapsed
        waits = waiting if passed > GRACE_S else ""
        if waits != self._reported:
            self._reported = waits
            self._notify(waits)
        if waiting and passed > self._patience.start:
            self.stuck = self._patience.late(False, waiting)
