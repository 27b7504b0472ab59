"""How long work shows how far it is: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cspm.progress import Progress
from cspm_run.output.console import say

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
        with _lines(console, what) as report:
            yield report
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


@contextmanager
def _lines(console: Console, what: str) -> Iterator[Progress]:
    """Give a progress function of which the last report is printed every so many seconds."""
    ended, begun = threading.Event(), time.monotonic()
    last = (0.0, what)

    def report(share: float, now: str) -> None:
        nonlocal last
        last = (share, now or what)

    def tell() -> None:
        while not ended.wait(LINE_S):
            share, doing = last
            say(console, progress_line(doing, share, time.monotonic() - begun))

    teller = threading.Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:
        yield report
    finally:
        ended.set()
        teller.join()


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
