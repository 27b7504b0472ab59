"""How long work shows how far it is: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cspm.progress import Progress
from cspm_run.console import say

# Between two lines where nobody watches [s].
LINE_S = 10.0
# From which share on the time that is left can be estimated.
_ESTIMATED_FROM = 0.02


@contextmanager
def shown(console: Console, what: str) -> Iterator[Progress]:
    """Give a progress function whose reports are shown on a console.

    Args:
        console: a terminal has a bar, which goes when the work ends; a pipe or file a line every
            10 s.
        what: is done; names the work until it reports another name.
    """
    if not console.is_terminal:
        yield _Lines(console, what).report
        return
    with Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    ) as bar:
        task = bar.add_task(escape(what), total=1.0)
        yield lambda share, now: bar.update(task, completed=share, description=escape(now or what))


class _Lines:
    """Reports a line after each so many seconds."""

    def __init__(self, console: Console, what: str) -> None:
        self._console, self._what = console, what
        self._begun = self._last = time.monotonic()

    def report(self, share: float, what: str) -> None:
        """Say how far the work is, unless that was said lately."""
        now = time.monotonic()
        if now - self._last < LINE_S:
            return
        self._last = now
        say(self._console, progress_line(what or self._what, share, now - self._begun))


def progress_line(what: str, share: float, elapsed_s: float) -> str:
    """Return how far work is in words.

    Args:
        what: is done.
        share: that is done, 0 to 1; 0 where it is not known.
        elapsed_s: since the work began [s].
    """
    if share < _ESTIMATED_FROM:
        return f"{what}, {elapsed_s:.0f} s"
    left = elapsed_s * (1.0 - share) / share
    return f"{what}, {share:.0%}, {left:.0f} s left"
