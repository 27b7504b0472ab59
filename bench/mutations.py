"""Whether tests notice a wrong sign, threshold or unit: `python -m bench.mutations [NAME …]`.

Each mutation changes one line in a copy of the checkout and runs the fast tests that have to notice
it; their list is `bench/mutations.yaml`.
A mutation that they let pass is a line that nothing holds.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.yaml_file import read_yaml

ROOT = Path(__file__).resolve().parents[1]
LIST = Path(__file__).with_suffix(".yaml")
_QUICKLY = ("-q", "-x", "-p", "no:cacheprovider", "-m", "not slow")
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


class Mutation(NamedTuple):
    """One line made wrong.

    Attributes:
        name: what is wrong then.
        file: path in the checkout.
        old: text that occurs once in the file.
        new: what replaces it.
        tests: path of the tests that have to fail.
    """

    name: str
    file: str
    old: str
    new: str
    tests: str


def mutations() -> tuple[Mutation, ...]:
    """Return those of `bench/mutations.yaml`."""
    return tuple(Mutation(**each) for each in read_yaml(LIST))


class Result(NamedTuple):
    """What tests made of a mutation: the first that failed, none if all passed."""

    mutation: Mutation
    noticed_by: str | None


def mutated(text: str, mutation: Mutation) -> str:
    """Return a file's text with the mutation.

    Raises:
        ValueError: the text to replace does not occur exactly once.
    """
    found = text.count(mutation.old)
    if found != 1:
        raise ValueError(f"{mutation.file}: {mutation.old!r} occurs {found} times, allowed: once")
    return text.replace(mutation.old, mutation.new)


def try_mutation(copy: Path, mutation: Mutation) -> Result:
    """Run tests on a copy of the checkout that has the mutation; the copy is as before afterwards.

    Raises:
        RuntimeError: the tests could not be run.
        ValueError: the text to replace does not occur exactly once.
    """
    file = copy / mutation.file
    before = file.read_text(encoding="utf-8")
    file.write_text(mutated(before, mutation), encoding="utf-8")
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *_QUICKLY, mutation.tests],
            cwd=copy,
            env=os.environ | {"PYTHONPATH": str(copy)},
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        file.write_text(before, encoding="utf-8")
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{mutation.tests}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    failed = _FAILED.search(done.stdout)
    return Result(mutation, failed[1] if failed and done.returncode else None)


def copy_checkout(target: Path) -> None:
    """Copy the files of the checkout that are under version control."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)


def table_of(results: Sequence[Result]) -> Table:
    """Return a table with a row for each mutation."""
    table = Table("mutation", "file", "noticed by")
    for mutation, noticed_by in results:
        table.add_row(mutation.name, mutation.file, noticed_by or "[red]nothing[/]")
    return table


def main() -> int:
    """Run the command line; return 1 if a mutation passes all tests."""
    parser = argparse.ArgumentParser(prog="python -m bench.mutations", description=__doc__)
    parser.add_argument("words", nargs="*", metavar="WORD", help="of the names; otherwise all")
    words = parser.parse_args().words
    chosen = [m for m in mutations() if not words or any(word in m.name for word in words)]
    with ScratchFolder("mutations") as place:
        copy_checkout(place)
        results = [try_mutation(place, mutation) for mutation in chosen]
    Console().print(table_of(results))
    return int(any(result.noticed_by is None for result in results))


if __name__ == "__main__":
    sys.exit(main())
