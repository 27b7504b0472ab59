"""What recordings themselves show, printed before what is made of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from cspm_run.output.console import say


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
