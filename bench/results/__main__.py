"""What results/steep-sea.md shows: `python -m bench.results`, or `make results`.

What was measured stays in a folder. A call measures what is missing there, or was measured by other
code, scenarios or test-beds, and writes the page from all of it. Ctrl-C ends it; what was under way
is lost, and the same command goes on.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console

from bench.page import into_page
from bench.performance.host import describe_machine
from bench.results.result_blocks import blocks_of, pictured
from bench.results.result_figures import draw_comparison, draw_limit
from bench.results.result_measures import LIMIT_PERIOD
from bench.results.result_store import ROOT, Kept, Measurement, Store
from bench.results.result_work import work_off

PAGE = ROOT / "results" / "steep-sea.md"
FIGURES = ROOT / "docs" / "figures"
KEEP = ROOT / ".results"
MACHINE, PICTURES = "machine", "pictures"


def main() -> int:
    """Run the command line; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m bench.results", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="of the worst case past the thesis")
    parser.add_argument("--keep", type=Path, metavar="DIR", default=KEEP, help="default: .results")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--only", nargs="+", default=[], metavar="BLOCK", help="renew only these")
    options = parser.parse_args()
    store, blocks, console = Store(options.keep), blocks_of(options.seeds), Console()
    names = [MACHINE, *blocks, PICTURES]
    unknown = [name for name in options.only if name not in names]
    if unknown:
        parser.error(f"--only: {', '.join(unknown)}, allowed: {', '.join(names)}")
    if options.workers < 1:
        parser.error(f"--workers: {options.workers}, allowed: 1 or more")
    chosen = options.only or names
    sources = {name: block.measurements for name, block in blocks.items()} | {PICTURES: pictured()}
    wanted = [each for name in chosen for each in sources.get(name, {}).values()]
    try:
        work_off(store, wanted, options.workers, lambda line: console.print(line, highlight=False))
    except KeyboardInterrupt:
        console.print(f"stopped; what was measured is in {options.keep}, the same command goes on")
        return 1
    for name in chosen:
        if name in blocks:
            into_page(
                PAGE,
                f"results: {name}",
                blocks[name].write(_found(store, blocks[name].measurements)),
            )
    if PICTURES in chosen:
        _draw(_found(store, pictured()))
    if MACHINE in chosen:
        everything = (each for source in sources.values() for each in source.values())
        every = {one.name: one for each in everything for one in (*each.needs, each)}
        into_page(
            PAGE,
            f"results: {MACHINE}",
            _machine_block(_kept(store, every), len(every), options.seeds),
        )
    return 0


def _kept(store: Store, measurements: Mapping[str, Measurement]) -> dict[str, Kept]:
    found = {name: store.find(each) for name, each in measurements.items()}
    return {name: each for name, each in found.items() if each is not None}


def _found(store: Store, measurements: Mapping[str, Measurement]) -> dict[str, object]:
    return {name: each.found for name, each in _kept(store, measurements).items()}


def _machine_block(kept: Mapping[str, Kept], count: int, seeds: int) -> str:
    machine = describe_machine()
    days = sorted({each.day for each in kept.values()}) or [machine["date"]]
    hours = sum(each.processor_s for each in kept.values()) / 3600.0
    return (
        f"Measured {' to '.join(dict.fromkeys((days[0], days[-1])))}, {machine['processor']},"
        f" {machine['software']}; {seeds} seeds. {len(kept)} of {count} measurements are by the"
        f" present code; they took {hours:.1f} h of one processor."
    )


def _draw(found: Mapping[str, object]) -> None:
    drawn = {name: each for name, each in found.items() if name != "limit"}
    draw_comparison(FIGURES / "past_thesis.png", drawn)
    least = np.array(found["limit"])
    draw_limit(FIGURES / "tension_limit.png", least, LIMIT_PERIOD, drawn["past the thesis"])


if __name__ == "__main__":
    raise SystemExit(main())
