"""A bar that fills while something lasts a known time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn


@contextmanager
def time_bar(console: Console, text: str, seconds: float) -> Iterator[Callable[[float], None]]:
    """Give what shows the time that has passed [s]; nothing is shown where nobody looks."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:.1f} s"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task(escape(text), total=seconds)
        yield lambda passed: bar.update(task, completed=passed)
