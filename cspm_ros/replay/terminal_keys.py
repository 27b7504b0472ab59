"""Single keys from a terminal, without waiting for the end of a line."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from types import TracebackType
from typing import Any

from typing_extensions import Self

RIGHT = "right"
_SEQUENCES = {"\x1b[C": RIGHT, "\x1bOC": RIGHT}
_ESCAPE = "\x1b"
_BYTES = 1024


class TerminalKeys:
    """Reads keys from standard input while it is a context; nothing where it is no terminal.

    Attributes:
        usable: whether standard input is a terminal that this process may read from.
    """

    def __init__(self, file: int | None = None) -> None:
        """Take the terminal's file descriptor, standard input unless given."""
        self._file = _standard_input() if file is None else file
        self.usable = os.isatty(self._file) and _in_foreground(self._file)
        self._before: list[Any] | None = None

    def read(self) -> list[str]:
        """Return the keys that were pressed since the last look: characters, or `RIGHT`."""
        if self._before is None or not select.select([self._file], [], [], 0)[0]:
            return []
        return list(split_keys(os.read(self._file, _BYTES).decode(errors="replace")))

    def __enter__(self) -> Self:
        if self.usable:
            self._before = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._before is not None:
            termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)
            self._before = None


def split_keys(text: str) -> Iterator[str]:
    """Yield the keys that a terminal's characters stand for; unknown sequences are left out."""
    while text:
        known = next((sequence for sequence in _SEQUENCES if text.startswith(sequence)), "")
        if known:
            yield _SEQUENCES[known]
            text = text[len(known) :]
        elif text.startswith(_ESCAPE):
            return
        else:
            yield text[0]
            text = text[1:]


def _standard_input() -> int:
    """Return standard input's file descriptor, −1 where it is closed or replaced."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, ValueError, OSError):
        return -1


def _in_foreground(file: int) -> bool:
    """Return whether reading would not stop this process, as it does one in the background."""
    try:
        return os.tcgetpgrp(file) == os.getpgrp()
    except OSError:
        return False
