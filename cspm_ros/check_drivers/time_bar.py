"""A bar that fills while something lasts a known time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn


class ShowTime(Protocol):
    """What shows the time that has passed [s], and what is being done where that changes."""

    def __call__(self, passed: float, what: str = ..., /) -> None:
        """Show it."""


@contextmanager
def time_bar(console: Console, text: str, seconds: float) -> Iterator[ShowTime]:
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

        def show(passed: float, what: str = text, /) -> None:
            bar.update(task, completed=passed, description=escape(what))

        yield show
