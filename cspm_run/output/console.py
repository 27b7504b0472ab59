"""What commands print on."""

from __future__ import annotations

from contextvars import ContextVar
from enum import Enum

from rich.console import Console

PIPE_WIDTH = 160


class Voice(Enum):
    """Where a command's text goes."""

    OUTPUT = "standard output"
    ERRORS = "standard error"
    NOWHERE = "nowhere"


# Of the command that runs; a command line runs in a context of its own, so that it ends with it.
VOICE: ContextVar[Voice] = ContextVar("voice", default=Voice.OUTPUT)


def make_console() -> Console:
    """Return a console that does not fold tables where nobody looks.

    It prints where `VOICE` says: data on standard output leave the text to standard error.
    """
    voice = VOICE.get()
    aside, silent = voice is Voice.ERRORS, voice is Voice.NOWHERE
    console = Console(stderr=aside, quiet=silent)
    if console.is_terminal:
        return console
    return Console(stderr=aside, quiet=silent, width=PIPE_WIDTH)


def say(console: Console, text: str) -> None:
    """Print a line as it is: names are no markup, and nothing is broken at the width."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)
