"""Diagnose recordings of other laboratories, and write what was said beside what is true."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

import cspm
from bench.markdown import markdown_table
from bench.real.dataset import Dataset, datasets
from bench.real.judgement import Judgement, judgement_of
from bench.real.least_squares import least_squares
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.new_folder import ScratchFolder

_HEADS = (
    "data set",
    "true, and how known",
    "verdict: what is named",
    "before",
    "re-tuned",
    "after",
    "true terms",
    "noise",
    "mark",
)


class Row(NamedTuple):
    """One data set: its judgement, and RMS torques on held-out data [N·m]."""

    dataset: Dataset
    verdict: str
    judgement: Judgement
    before: float
    retuned: float
    after: float
    true_terms: float
    noise: float


def measured(dataset: Dataset, place: Path) -> Row:
    """Import, diagnose and judge one data set."""
    with ScratchFolder("real") as folder:
        search, held_out = dataset.imported(place, folder)
        found = cspm.diagnose(search, held_out=held_out)
        (fit,) = found.result.fit
        own = [[read_measurement(each) for each in part] for part in (search, held_out)]
        true_terms = least_squares(*own, dataset.truth).error
    after = fit.after if fit.steady is None else fit.steady
    judgement = judgement_of(dataset, found.data)
    return Row(
        dataset, found.verdict, judgement, fit.before, fit.retuned, after, true_terms, fit.noise
    )


def table_of(rows: Sequence[Row]) -> str:
    """Return the table in Markdown."""
    lines = []
    for row in rows:
        truth = "; ".join(_truth(name, own) for name, own in row.dataset.truth.items())
        named = "; ".join(row.judgement.named) or "nothing"
        why = f" ({row.judgement.why})" if row.judgement.why else ""
        errors = row.before, row.retuned, row.after, row.true_terms, row.noise
        lines.append(
            (
                f"{row.dataset.name} ({row.dataset.source})",
                f"{truth} ({row.dataset.known})",
                f"{row.verdict}: {named}",
                *(f"{1e3 * each:.3g}" for each in errors),
                f"{row.judgement.mark}{why}",
            )
        )
    return markdown_table(_HEADS, lines)


def _truth(name: str, ranges: Any) -> str:
    known = ", ".join(f"{key} {low:g} to {high:g}" for key, (low, high) in ranges.items())
    return f"{name} {known}".strip()


def main() -> int:
    """Run the command line; return 1 if a data set is diagnosed wrongly."""
    parser = argparse.ArgumentParser(prog="python -m bench.real", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR", help="with the data sets")
    parser.add_argument("--json", type=Path, help="also write the table's numbers")
    given = parser.parse_args()
    console, rows = Console(stderr=True), []
    for dataset in datasets():
        place = dataset.place(given.folders)
        if place is None:
            console.print(f"{dataset.name}: no folder {dataset.folder} below what is given")
            continue
        rows.append(measured(dataset, place))
        console.print(f"{dataset.name}: {rows[-1].judgement.mark}")
    print(table_of(rows))
    if given.json is not None:
        content = [row._asdict() | {"dataset": row.dataset.name} for row in rows]
        given.json.write_text(json.dumps(content, indent=1, default=tuple), "utf-8")
    return int(any(row.judgement.mark == "wrong" for row in rows))


if __name__ == "__main__":
    sys.exit(main())
