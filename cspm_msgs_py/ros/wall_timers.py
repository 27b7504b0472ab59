"""Timers of a loop that looks at the clock itself.

A timer of rclpy costs its executor tens of microseconds a call.
"""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Callable

_NANOSECONDS = 1_000_000_000


class WallTimer:
    """Calls something at an interval of wall time until it is cancelled."""

    def __init__(self, seconds: float, call: Callable[[], None]) -> None:
        self.period_ns = max(1, round(seconds * _NANOSECONDS))
        self.call: Callable[[], None] | None = call

    def cancel(self) -> None:
        """Call it no more."""
        self.call = None


class WallTimers:
    """Timers by when they are due; a call that comes late skips those that were due meanwhile."""

    def __init__(self, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Take the clock [ns]."""
        self._now_ns = now_ns
        self._queue: list[tuple[int, int, WallTimer]] = []
        self._made = 0

    def add(self, seconds: float, call: Callable[[], None]) -> WallTimer:
        """Have `call` called at an interval, one interval from now for the first time."""
        timer = WallTimer(seconds, call)
        self._made += 1
        heapq.heappush(self._queue, (self._now_ns() + timer.period_ns, self._made, timer))
        return timer

    def run(self) -> float:
        """Call what is due, each once; return how long there is to the next [s]."""
        queue, now = self._queue, self._now_ns()
        while queue and queue[0][0] <= now:
            due, number, timer = queue[0]
            if timer.call is None:
                heapq.heappop(queue)
                continue
            late = (now - due) // timer.period_ns
            heapq.heapreplace(queue, (due + (late + 1) * timer.period_ns, number, timer))
            timer.call()
        return (queue[0][0] - self._now_ns()) / _NANOSECONDS if queue else math.inf
