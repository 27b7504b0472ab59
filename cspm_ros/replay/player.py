"""Playing a bag against the time: pause, single steps, rate.

Wall time comes in with every call, in seconds of any steady clock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import groupby
from typing import NamedTuple

from cspm_msgs_py.bag import BagMessage
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.topics import QOS_DEPTH

UNLIMITED = 0.0
SLOWEST, FASTEST = 1e-3, 1e3
# Fewer than a reader keeps, so that what was held up does not overrun it.
MOST_AT_ONCE = QOS_DEPTH - 2
_RATES = [float(f"{digit}e{power}") for power in range(-3, 4) for digit in (1, 2, 5)]


class Instant(NamedTuple):
    """All messages of one log time [ns], in the bag's order."""

    log_ns: int
    messages: list[BagMessage]


def instants(messages: Iterable[BagMessage], end_ns: int) -> Iterator[Instant]:
    """Yield messages, which come in order of log time, by instants up to `end_ns` [ns]."""
    for log_ns, found in groupby(messages, key=lambda message: message.log_ns):
        if log_ns > end_ns:
            return
        yield Instant(log_ns, list(found))


class Player:
    """Plays instants in order, each once it is due.

    Attributes:
        rate: bag time per wall time; `UNLIMITED` plays without regard to time.
        paused: whether only single steps are played.
        position_ns: log time of the last instant played; before it, of the start [ns].
        messages: number of messages played.
        blocked: whether an instant is due and the readers are not ready for it.
        ended_early: whether it was ended before everything was played.
    """

    def __init__(
        self,
        found: Iterator[Instant],
        play: Callable[[Instant], None],
        start_ns: int,
        rate: float,
        *,
        paused: bool = False,
        ready: Callable[[], bool] = lambda: True,
    ) -> None:
        """Take what to play.

        Args:
            found: the instants.
            play: sends one.
            start_ns: the log time at which playing begins [ns].
            rate: see `check_rate`.
            paused: whether to begin paused.
            ready: whether the readers can take the next instant.

        Raises:
            InputError: the first instant cannot be read.
        """
        self.rate, self.paused = rate, paused
        self.position_ns = start_ns
        self.messages = 0
        self.blocked = self.ended_early = False
        self._found, self._play, self._ready = found, play, ready
        self._next = next(found, None)
        self._owed = 0
        self._began = False
        # Bag time and wall time at which both last began to run together.
        self._anchor_ns, self._anchor_s = start_ns, 0.0

    @property
    def finished(self) -> bool:
        """Whether everything was played."""
        return self._next is None

    def begin(self, now_s: float) -> None:
        """Let time run."""
        self._began, self._anchor_s = True, now_s

    def advance(self, now_s: float) -> None:
        """Play what is due, of what was held up only the most that readers can take at once.

        Raises:
            InputError: the bag is damaged.
        """
        self.blocked = False
        for _ in range(MOST_AT_ONCE):
            if not self._began or self._next is None or not self._due(now_s):
                return
            if not self._ready():
                self.blocked = True
                return
            if self._owed:
                self._owed -= 1
                self._anchor_ns = max(self._anchor_ns, self._next.log_ns)
            self._play(self._next)
            self.position_ns = self._next.log_ns
            self.messages += len(self._next.messages)
            self._next = next(self._found, None)

    def pause(self, now_s: float) -> None:
        """Stop the time."""
        self._anchor(now_s)
        self.paused = True

    def resume(self, now_s: float) -> None:
        """Go on from where it stopped."""
        if self.paused:
            self.paused, self._anchor_s = False, now_s

    def step(self, now_s: float) -> bool:
        """Pause, and play one instant as soon as readers are ready; return whether there is one."""
        self.pause(now_s)
        if self._next is None:
            return False
        self._owed += 1
        self.advance(now_s)
        return True

    def set_rate(self, rate: float, now_s: float) -> None:
        """Go on at another rate."""
        self._anchor(now_s)
        self.rate = rate

    def end(self) -> None:
        """Play nothing more."""
        self.ended_early |= self._next is not None
        self._next = None

    def _due(self, now_s: float) -> bool:
        if self._owed:
            return True
        if self.paused or self._next is None:
            return False
        return self.rate == UNLIMITED or self._next.log_ns <= self._reached(now_s)

    def _reached(self, now_s: float) -> int:
        return self._anchor_ns + int((now_s - self._anchor_s) * self.rate * 1e9)

    def _anchor(self, now_s: float) -> None:
        """Note how far bag time has come: never past what is still to be played."""
        if self._began and not self.paused:
            reached = self.position_ns if self.rate == UNLIMITED else self._reached(now_s)
            if self._next is not None:
                reached = min(reached, self._next.log_ns)
            self._anchor_ns, self._anchor_s = reached, now_s


def check_rate(rate: float) -> float:
    """Return a rate that can be played at.

    Raises:
        InputError: it is not.
    """
    if rate == UNLIMITED or SLOWEST <= rate <= FASTEST:
        return rate
    raise InputError(f"rate {rate:g}: allowed: {SLOWEST:g} to {FASTEST:g}, or 0 with nodes in step")


def neighbour_rate(rate: float, *, faster: bool) -> float:
    """Return the next of the rates … 0.5, 1, 2, 5, 10 … within what is allowed."""
    if rate == UNLIMITED:
        return rate if faster else 1.0
    allowed = [each for each in _RATES if SLOWEST <= each <= FASTEST]
    if faster:
        return min((each for each in allowed if each > rate * 1.001), default=rate)
    return max((each for each in allowed if each < rate * 0.999), default=rate)
