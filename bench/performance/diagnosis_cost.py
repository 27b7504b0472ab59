"""Time and memory of `cspm diagnose --no-closed-loop`, watched from outside.

Processor time is given beside time by the clock, which other programs make longer.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from bench.accuracy.planted_effects import PlantedCase, record
from bench.performance.child import start_cspm, watched
from bench.performance.thesis_machine import SCENARIOS

SEED = 100
PLANTED = PlantedCase("winch_coulomb_friction", ("surge_2",), {"torque": 0.031})


class Cost(NamedTuple):
    """What a command took: by the clock [s], of the processor [s], and at most of memory [B]."""

    clock: float
    processor: float
    memory: int


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.diagnosis_cost", description=__doc__
    )
    parser.add_argument("--recorded", type=float, nargs="+", default=[60.0, 600.0], metavar="S")
    parser.add_argument("--recording", type=Path, help="one of the worst case that there is")
    arguments = parser.parse_args()
    print("| recording | took [s] | of the processor [s] | memory [GB] |\n|---|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as place:
        if arguments.recording is not None:
            print_cost(arguments.recording.name, cost_of(arguments.recording, Path(place)))
            return
        for duration in arguments.recorded:
            folder = Path(place) / f"{duration:g} s"
            record(PLANTED, SEED, folder, duration)
            print_cost(folder.name, cost_of(folder, Path(place)))


def print_cost(name: str, cost: Cost) -> None:
    """Print a row of the table."""
    row = f"{cost.clock:.0f} | {cost.processor:.0f} | {cost.memory / 1e9:.2f}"
    print(f"| {name} | {row} |", flush=True)


def cost_of(recorded: Path, out: Path) -> Cost:
    """Diagnose with the file that knows of no effect, into `out`; pages are not drawn."""
    testbed = str(SCENARIOS / "testbeds" / "thesis.yaml")
    words = ["diagnose", str(recorded), "--testbed", testbed, "--no-closed-loop"]
    begun = time.perf_counter()
    child = start_cspm([*words, "--json", str(out / "diagnosis.json")], {})
    looks = list(watched(child, lambda p: (p.memory_info().rss, sum(p.cpu_times()[:2]))))
    memory, processor = (max(column) for column in zip(*looks, strict=True))
    return Cost(time.perf_counter() - begun, processor, memory)


if __name__ == "__main__":
    main()
