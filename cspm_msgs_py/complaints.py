"""What is wrong, said often enough to be seen and seldom enough to be read."""

from __future__ import annotations

import time
from collections.abc import Callable

INTERVAL_S = 1.0


class Complaints:
    """Says at most one thing a second about each subject, and how much was left unsaid."""

    def __init__(
        self, say: Callable[[str], None], now: Callable[[], float] = time.monotonic
    ) -> None:
        """Take what says a line, and the clock to go by [s]."""
        self._say, self._now = say, now
        self._said: dict[str, float] = {}
        self._unsaid: dict[str, int] = {}

    def add(self, subject: str, text: str) -> None:
        """Say `text`, unless something was said of `subject` less than a second ago."""
        now = self._now()
        if now - self._said.get(subject, -INTERVAL_S) < INTERVAL_S:
            self._unsaid[subject] = self._unsaid.get(subject, 0) + 1
            return
        self._said[subject] = now
        unsaid = self._unsaid.pop(subject, 0)
        self._say(text + f" (and {unsaid} more of {subject} since the last line)" * bool(unsaid))
