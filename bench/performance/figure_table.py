"""The table of all figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from bench.performance.measured_figure import Figure

COLOURS = {True: "green", False: "red", None: "none"}


def print_report(console: Console, machine: Mapping[str, str], figures: Sequence[Figure]) -> None:
    """Print the machine's description, the table, and how each figure was measured."""
    for name, value in machine.items():
        console.print(f"{name + ':':14}{value}", highlight=False, soft_wrap=True)
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("")
    for column in ("median", "min", "max", "reach"):
        table.add_column(column, justify="right", no_wrap=True)
    group = ""
    for figure in figures:
        if figure.group != group:
            group = figure.group
            table.add_section()
            table.add_row(f"[bold]{group}[/]")
        _add_row(table, figure)
    console.print(table)
    for figure in figures:
        console.print(
            f"{figure.group}: {figure.what}: {figure.note}", highlight=False, soft_wrap=True
        )


def _add_row(table: Table, figure: Figure) -> None:
    unit = escape(f" [{figure.unit}]") if figure.unit else ""
    numbers = (figure.median, min(figure.samples), max(figure.samples))
    cells = [f"{number:#.3g}".rstrip(".") for number in numbers]
    cells[0] = f"[{COLOURS[figure.reached]}]{cells[0]}[/]"
    if len(figure.samples) == 1:
        cells[1:] = ["", ""]
    table.add_row(f"  {figure.what}{unit}", *cells, figure.reach)
