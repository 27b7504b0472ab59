"""The table that compares the thesis's values with computed ones."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.table import Table

from cspm_control.analysis.claim import Claim

# Smaller numbers are round-off and shown as 0.
NOTHING = 1e-9


def shown(value: float, published: str) -> str:
    """Return a number to four digits or as many as were published; round-off alone as 0."""
    digits = max(4, sum(each.isdigit() for each in published))
    return "0" if abs(value) < NOTHING else f"{value:.{digits}g}"


def claim_table(title: str, claims: Sequence[Claim], headings: dict[str, str]) -> Table:
    """Return a table of published values and, by heading, computed ones and their agreement."""
    table = Table(title=title, box=box.SIMPLE_HEAD)
    table.add_column("figure")
    table.add_column("thesis", justify="right")
    for heading in headings.values():
        table.add_column(heading, justify="right")
        table.add_column("holds?")
    for claim in claims:
        cells = [
            cell
            for way in headings
            for cell in (
                shown(claim.found[way], claim.published),
                "[green]yes[/]" if claim.holds(way) else "[red]no[/]",
            )
        ]
        table.add_row(claim.what, claim.published, *cells)
    return table
