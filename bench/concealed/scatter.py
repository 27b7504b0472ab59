"""Do intervals hold the scatter between independent runs of one machine?

`python -m bench.concealed.scatter DIR` diagnoses each run alone by the file of a newcomer, judged
on the next run, and holds the amounts against each other. Two runs agree where their difference is
within the root of the sum of the squares of both half-widths.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import cspm
from bench.concealed.machine import Machine
from bench.concealed.machine_table import print_machine_table
from bench.real.dataset import Dataset
from cspm_ident.diagnosis.reporting.verdict import named_in

# Of machines with three runs and more, those beyond search and hold-out.
FURTHER: Mapping[str, Sequence[str]] = {
    **{f"kuka_{axis}{side}": (f"C_{axis}.csv",) for axis in (1, 4, 6) for side in ("", "_motor")},
    "kite": (),
}
_HEADS = ("machine", "parameter", "runs", "pairs within their intervals", "largest difference")


class Estimate(NamedTuple):
    """An amount of one run, and half the width of its 95 % interval."""

    run: str
    value: float
    half: float


def estimates_of(machine: Machine, place: Path) -> dict[str, list[Estimate]]:
    """Return what each run says of each parameter, by effect and parameter."""
    dataset = machine.dataset
    runs = [*dataset.search, *dataset.held_out, *FURTHER[machine.name]]
    found: dict[str, list[Estimate]] = {}
    for run, other in zip(runs, [*runs[1:], runs[0]], strict=True):
        for name, value, half in _said(dataset._replace(search=[run], held_out=[other]), place):
            found.setdefault(name, []).append(Estimate(Path(run).stem, value, half))
    return found


def _said(dataset: Dataset, place: Path) -> list[tuple[str, float, float]]:
    with tempfile.TemporaryDirectory() as room:
        searched, held_out = dataset.imported(place, Path(room))
        found = cspm.diagnose(searched, held_out=held_out, closed_loop=False).data
    return [
        (f"{f['effect']} {p['name']}", p["value"], 0.5 * (p["ci95"][1] - p["ci95"][0]))
        for f in named_in(found)
        for p in f["parameters"]
        if p["ci95"] is not None
    ]


def agreeing(estimates: Sequence[Estimate]) -> tuple[int, int]:
    """Return how many pairs of runs agree, and how many there are."""
    pairs = list(combinations(estimates, 2))
    held = sum((a.value - b.value) ** 2 <= a.half**2 + b.half**2 for a, b in pairs)
    return held, len(pairs)


def rows_of(machine: Machine, place: Path) -> list[tuple[str, ...]]:
    """Return the table's rows of a machine: what at least two runs name."""
    rows = []
    for name, own in estimates_of(machine, place).items():
        if len(own) < 2:
            continue
        held, pairs = agreeing(own)
        values = [each.value for each in own]
        words = "; ".join(f"{e.run}: {e.value:.3g} ± {e.half:.2g}" for e in own)
        span = (max(values) - min(values)) / abs(sum(values) / len(values))
        rows.append((machine.name, name, words, f"{held} of {pairs}", f"{100 * span:.0f} %"))
    return rows


def main() -> None:
    """Run the command line."""

    def wanted(machine: Machine, place: Path) -> list[tuple[str, ...]]:
        return rows_of(machine, place) if machine.name in FURTHER else []

    print_machine_table("bench.concealed.scatter", __doc__, _HEADS, wanted)


if __name__ == "__main__":
    main()
