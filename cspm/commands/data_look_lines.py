"""What recordings are for and what they themselves show, printed before what is made of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from cspm_run.output.console import say

SEARCHED, FITTED, HELD_OUT = "searched", "fitted", "held out"
SPLIT = "searched, its last three tenths held out"


def print_roles(
    console: Console, recordings: Iterable[Path], held_out: Iterable[Path], role: str
) -> None:
    """Print role and path of each recording, a line each.

    Args:
        console: where to print.
        recordings: to search or to fit.
        held_out: which only judge.
        role: of `recordings`, in words.
    """
    for path in recordings:
        say(console, f"{role}: {path}")
    for path in held_out:
        say(console, f"{HELD_OUT}: {path}")


def print_data_look(console: Console, checks: Sequence[Mapping[str, Any]]) -> None:
    """Print the checks that found something, and how many did not.

    Args:
        console: where to print.
        checks: as `DataCheck.data` gives them.
    """
    wrong = [each for each in checks if not each["ok"]]
    say(console, f"data: {len(checks) - len(wrong)} of {len(checks)} checks passed")
    for each in wrong:
        name = Path(each["recording"]).name
        say(console, f"• {name}, {each['check']}: {each['what']}; {each['remedy']}")
