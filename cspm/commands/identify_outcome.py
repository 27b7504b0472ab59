"""Output of the results of every `cspm identify` command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rich.console import Console

from cspm.commands.data_look_lines import print_data_look
from cspm.identification.identified import Identification, Outcome
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

Found = TypeVar("Found", bound=Outcome)


def hand_out(
    found: Identification[Found],
    show: Callable[[Console, Found], None],
    folder: Path | None,
    json: Path | None,
) -> bool:
    """Print the identified parameters, and write the requested files.

    Returns whether all of them are a result.

    Args:
        found: the identified parameters.
        show: prints them.
        folder: a new folder for files; None writes none.
        json: file for the printed results; None writes none.
    """
    console = make_console()
    checks = [each.data() for each in found.data_checks]
    if checks:
        print_data_look(console, checks)
    show(console, found.result)
    for objection in found.objections:
        say(console, objection)
    written: dict[str, str] = {}
    if folder is not None:
        written = found.write(folder)
        say(console, f"written: {', '.join(written.values())}")
    if json is not None:
        data = {"objections": list(found.objections), "data_checks": checks, "written": written}
        write_json(json, found.data() | data)
    return not found.objections


def interval_text(value: float, interval: tuple[float, float], digits: int = 6) -> str:
    """Return a number and its interval as text for a table."""
    low, high = (f"{end:.{digits}g}" for end in interval)
    return f"{value:.{digits}g} ({low} … {high})"
