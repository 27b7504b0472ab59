"""Tables of scored parts as CSV under results/, one file per table, one column `part` more."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

RESULTS = Path(__file__).resolve().parents[2] / "results"
STORE = RESULTS / "sealed"
# Files by the section of a scorecard page, in the order of the section's tables.
SECTIONS = {
    "Against the targets": ("targets",),
    "Peers": ("peers", "peer_estimates"),
    "Without one safeguard": ("ablations", "ablation_estimates"),
    "By amount": ("amounts",),
    "By stratum": ("strata",),
    "Verdicts": ("verdicts",),
    "What was named first": ("first",),
    "Parameters, fit, probabilities, time": ("parameters", "probabilities"),
    "Every recording": ("recordings",),
}
_TRUTH = re.compile(r"truth file SHA-256 `(\w+)`\. Scored (\S+) ")

Row = Mapping[str, str]


def read_table(folder: Path, name: str) -> list[dict[str, str]]:
    """Return the rows of one table of all parts, each with its `part`; none without the file."""
    path = folder / f"{name}.csv"
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def add_page(page: Path, part: str, folder: Path = STORE) -> None:
    """Add the tables of a page that `python -m bench.blind score --page` wrote.

    Args:
        page: the scorecard page of one part.
        part: its number, or a name.
        folder: that of the CSV files.

    Raises:
        ValueError: the page names no truth file; the part, or one of its recordings, is there.
    """
    text = page.read_text(encoding="utf-8")
    truth = _TRUTH.search(text)
    if truth is None:
        raise ValueError(
            f"{page}: no truth file named, allowed: a page of `python -m bench.blind score`"
        )
    parts = read_table(folder, "parts")
    if any(each["part"] == part for each in parts):
        raise ValueError(f"{folder}: part {part} is already there, allowed: a new number")
    found = {name: rows for name, rows in _tables_of(text)}
    _refuse_twice(folder, truth.group(1), parts, found["recordings"], page)
    recordings = str(len(found["recordings"]))
    found["parts"] = [{"truth": truth.group(1), "scored": truth.group(2), "recordings": recordings}]
    for name, rows in found.items():
        _append(folder, name, [{"part": part, **row} for row in rows])


def _refuse_twice(
    folder: Path, truth: str, parts: list[dict[str, str]], rows: list[Row], page: Path
) -> None:
    """Raise a ValueError where a recording of the same truth was scored in an earlier part."""
    same = {each["part"] for each in parts if each["truth"] == truth}
    earlier = {e["recording"] for e in read_table(folder, "recordings") if e["part"] in same}
    twice = earlier & {row["recording"] for row in rows}
    if twice:
        raise ValueError(f"{page}: {len(twice)} recordings are in an earlier part")


def _tables_of(text: str) -> Iterator[tuple[str, list[Row]]]:
    """Yield name and rows of each table of a scorecard page."""
    for section in text.split("\n## ")[1:]:
        title, body = section.split("\n", 1)
        tables = [lines for lines in body.split("\n\n") if lines.lstrip().startswith("|")]
        yield from zip(SECTIONS.get(title, ()), map(_rows, tables), strict=False)


def _rows(table: str) -> list[Row]:
    """Return the rows of a Markdown table by its heads; a head without a name is `measure`."""
    heads, _, *rows = ([c.strip() for c in e.strip("|").split("|")] for e in table.split("\n") if e)
    return [dict(zip([h or "measure" for h in heads], row, strict=True)) for row in rows]


def _append(folder: Path, name: str, rows: Iterable[Row]) -> None:
    """Write a table again with further rows, columns in the order of their first appearance."""
    every = [*read_table(folder, name), *rows]
    heads = list(dict.fromkeys(head for row in every for head in row))
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, heads, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(every)
