"""How long work shows how far it is: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, ProgressColumn, Task, TaskProgressColumn, TextColumn
from rich.progress import Progress as Bar
from rich.text import Text

from cspm.progress import Progress
from cspm_run.output.console import say

# Between two lines where nobody watches [s].
LINE_S = 10.0
# From which share on the time that is left can be estimated.
_ESTIMATED_FROM = 0.02
# By how much an estimate may exceed what was promised before the promise is withdrawn.
_TOLERATED = 1.25


@contextmanager
def shown(console: Console, what: str) -> Iterator[Progress]:
    """Give a progress function whose reports are shown on a console.

    Args:
        console: a terminal has a bar, which goes when the work ends; a pipe or file a line every
            10 s.
        what: is done; names the work until it reports another name.
    """
    if not console.is_terminal:
        with _lines(console, what) as report:
            yield report
        return
    remaining = Remaining()
    with Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        _TimeColumn(remaining),
        console=console,
        transient=True,
    ) as bar:
        task = bar.add_task(escape(what), total=1.0)
        yield lambda share, now: bar.update(task, completed=share, description=escape(now or what))


class Remaining:
    """What is said of the time of one piece of work: what remains, but never more than before.

    Shares are estimates, and a step may take longer than they promised. Then what has passed is
    said instead, until the work is back on its way.
    """

    def __init__(self) -> None:
        """Begin with nothing said."""
        self._said = math.inf  # the last [s]
        self._end = -math.inf  # when the work would have ended by that, since it began [s]

    def words(self, share: float, elapsed_s: float) -> str:
        """Return what remains or has passed.

        Args:
            share: that is done, 0 to 1; 0 where it is not known.
            elapsed_s: since the work began [s].
        """
        if not _ESTIMATED_FROM <= share < 1.0:
            return f"{elapsed_s:.0f} s"
        left = elapsed_s * (1.0 - share) / share
        promised = self._end - elapsed_s
        if left <= self._said:
            self._end = elapsed_s + left
        elif left <= _TOLERATED * promised:
            left = promised
        else:
            return f"{elapsed_s:.0f} s so far"
        self._said = left
        return f"{left:.0f} s left"


class _TimeColumn(ProgressColumn):
    """The same words on a terminal, renewed once a second."""

    max_refresh = 1.0

    def __init__(self, remaining: Remaining) -> None:
        """Show what this says."""
        super().__init__()
        self._remaining = remaining

    def render(self, task: Task) -> Text:
        """Return the words for how far the bar is."""
        return Text(self._remaining.words(task.completed, task.elapsed or 0.0))


@contextmanager
def _lines(console: Console, what: str) -> Iterator[Progress]:
    """Give a progress function of which the last report is printed every so many seconds."""
    ended, begun, remaining = threading.Event(), time.monotonic(), Remaining()
    last = (0.0, what)

    def report(share: float, now: str) -> None:
        nonlocal last
        last = (share, now or what)

    def tell() -> None:
        while not ended.wait(LINE_S):
            share, doing = last
            say(console, progress_line(doing, share, time.monotonic() - begun, remaining))

    teller = threading.Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:
        yield report
    finally:
        ended.set()
        teller.join()


def progress_line(what: str, share: float, elapsed_s: float, remaining: Remaining) -> str:
    """Return how far work is in words.

    Args:
        what: is done.
        share: that is done, 0 to 1; 0 where it is not known.
        elapsed_s: since the work began [s].
        remaining: of this work.
    """
    known = f", {share:.0%}" if share >= _ESTIMATED_FROM else ""
    return f"{what}{known}, {remaining.words(share, elapsed_s)}"
