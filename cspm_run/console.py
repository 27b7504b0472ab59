"""What commands print on."""

from __future__ import annotations

from rich.console import Console

PIPE_WIDTH = 160


def make_console() -> Console:
    """Return a console that does not fold tables where nobody looks."""
    return Console() if Console().is_terminal else Console(width=PIPE_WIDTH)


def say(console: Console, text: str) -> None:
    """Print a line as it is: names are no markup, and nothing is broken at the width."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)
