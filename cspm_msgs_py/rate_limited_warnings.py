"""Warnings of a loop, limited in rate so that they stay readable."""

from __future__ import annotations

import time
from collections.abc import Callable

INTERVAL_S = 1.0


class RateLimitedWarnings:
    """Passes on at most one line a second per subject, with the number of those held back."""

    def __init__(
        self, print_line: Callable[[str], None], now: Callable[[], float] = time.monotonic
    ) -> None:
        """Take what prints a line, and the clock to use [s]."""
        self._print, self._now = print_line, now
        self._printed: dict[str, float] = {}
        self._held_back: dict[str, int] = {}

    def add(self, subject: str, text: str) -> None:
        """Print `text`, unless a line on `subject` was printed less than a second ago."""
        now = self._now()
        if now - self._printed.get(subject, -INTERVAL_S) < INTERVAL_S:
            self._held_back[subject] = self._held_back.get(subject, 0) + 1
            return
        self._printed[subject] = now
        held_back = self._held_back.pop(subject, 0)
        self._print(
            text + f" (and {held_back} more of {subject} since the last line)" * bool(held_back)
        )
