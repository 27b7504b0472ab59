"""The command line of a table with rows of every machine whose recordings are there."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from bench.concealed.machine import Machine, machines
from bench.markdown import markdown_table

Rows = Callable[[Machine, Path], Iterable[Sequence[str]]]


def print_machine_table(name: str, about: str | None, heads: Sequence[str], rows_of: Rows) -> None:
    """Print a table as Markdown, for the folders of data on the command line.

    Args:
        name: of the module that is run.
        about: its documentation.
        heads: of the columns.
        rows_of: rows of a machine, from the folder of its recordings; none where it has none.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {name}", description=about)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    folders = parser.parse_args().folders
    places = ((machine, machine.dataset.place(folders)) for machine in machines())
    there = ((machine, place) for machine, place in places if place is not None)
    print(markdown_table(heads, [row for each in there for row in rows_of(*each)]))
