"""What a command refuses by its arguments alone, before its slow parts are loaded."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.library import find_scenario, find_testbed

SEARCHED, FITTED, HELD_OUT = "searched", "fitted", "held out"
SPLIT = "searched, its last three tenths held out"


def begin_judged(
    role: str,
    recordings: Sequence[Path],
    held_out: Sequence[Path],
    testbed: Path | None,
    out: Path | None,
) -> None:
    """Print role and path of each recording, a line each, and refuse what is not there.

    Args:
        role: of `recordings`, in words.
        recordings: to search or to fit.
        held_out: which only judge.
        testbed: a file or a name of the library.
        out: a new folder.

    Raises:
        InputError: see `check_given`.
    """
    refuse_existing(out)
    from cspm_run.output.console import make_console, say

    console = make_console()
    for path in recordings:
        say(console, f"{role}: {path}")
    for path in held_out:
        say(console, f"{HELD_OUT}: {path}")
    check_given([*recordings, *held_out], testbed)


def check_analysed(scenario: str, testbed: str | Path | None, out: Path | None = None) -> None:
    """Refuse scenarios and test-beds that are not there, and a folder that is.

    Raises:
        InputError: naming what is missing, with the library, or already exists.
    """
    find_scenario(scenario)
    check_given((), None if testbed is None else Path(testbed), out)


def check_given(
    recordings: Iterable[Path | None], testbed: Path | None = None, out: Path | None = None
) -> None:
    """Refuse recordings and test-beds that are not there, and a folder that is.

    Args:
        recordings: to read; None, for one that was not given, is fine.
        testbed: a file or a name of the library.
        out: a new folder.

    Raises:
        InputError: naming what is missing, or already exists.
    """
    for each in recordings:
        if each is not None and not each.exists():
            raise InputError(f"{each}: no such file or folder")
    if testbed is not None:
        find_testbed(str(testbed))
    refuse_existing(out)
