"""What every `cspm identify` command does with its result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, TypeVar

from rich.console import Console

from cspm_run.console import make_console, say
from cspm_run.summary import write_json


class Outcome(Protocol):
    """What was identified."""

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""


Found = TypeVar("Found", bound=Outcome)


def hand_out(
    found: Found,
    show: Callable[[Console, Found], None],
    write: Callable[[Path, Found], dict[str, str]],
    folder: Path | None,
    json: Path | None,
) -> None:
    """Print what was identified, and write what was asked for.

    Args:
        found: what was identified.
        show: prints it.
        write: makes the folder and fills it; returns what is in it, by kind.
        folder: a new one; None writes none.
        json: where to write what is printed; None writes none.
    """
    console = make_console()
    show(console, found)
    written: dict[str, str] = {}
    if folder is not None:
        written = write(folder, found)
        say(console, f"written: {', '.join(written.values())}")
    if json is not None:
        write_json(json, found.data() | {"written": written})
