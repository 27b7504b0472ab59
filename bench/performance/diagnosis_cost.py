"""Time and memory of `cspm diagnose --no-closed-loop`, watched from outside.

Processor time is given beside time by the clock, which other programs make longer, and the plant's
speed before and after, which tells how fast the processor is.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NamedTuple

from bench.accuracy.planted_effects import PlantedCase, record
from bench.performance.child import start_cspm, watched
from bench.performance.plant_speed import plant_step
from bench.performance.thesis_machine import PERIOD_NS, SCENARIOS, ThesisMachine, roll_damping
from cspm_msgs_py.new_folder import ScratchFolder

SEED = 100
PLANTED = PlantedCase("winch_coulomb_friction", ("surge_2",), {"torque": 0.031})


class Cost(NamedTuple):
    """What a command took.

    Attributes:
        clock: by the clock [s].
        processor: of the processor [s].
        memory: at most [B].
        plant: the plant's speed before and after, the mean, as multiple of real time.
    """

    clock: float
    processor: float
    memory: int
    plant: float


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.diagnosis_cost", description=__doc__
    )
    parser.add_argument("--recorded", type=float, nargs="+", default=[60.0, 600.0], metavar="S")
    parser.add_argument("--recording", type=Path, help="one of the worst case that there is")
    arguments = parser.parse_args()
    columns = ("recording", "took [s]", "of the processor [s]", "memory [GB]", "plant [×]")
    print(f"| {' | '.join(columns)} |\n|---|---:|---:|---:|---:|")
    with ScratchFolder("diagnosis-cost") as place:
        if arguments.recording is not None:
            print_cost(arguments.recording.name, cost_of(arguments.recording, place))
            return
        for duration in arguments.recorded:
            folder = place / f"{duration:g} s"
            record(PLANTED, SEED, folder, duration)
            print_cost(folder.name, cost_of(folder, place))


def print_cost(name: str, cost: Cost) -> None:
    """Print a row of the table."""
    row = f"{cost.clock:.0f} | {cost.processor:.0f} | {cost.memory / 1e9:.2f} | {cost.plant:.0f}"
    print(f"| {name} | {row} |", flush=True)


def cost_of(recorded: Path, out: Path) -> Cost:
    """Diagnose with the file that knows of no effect, into `out`; pages are not drawn."""
    testbed = str(SCENARIOS / "testbeds" / "thesis.yaml")
    words = ["diagnose", str(recorded), "--testbed", testbed, "--no-closed-loop"]
    machine = ThesisMachine(roll_damping())
    before, begun = plant_step(machine), time.perf_counter()
    child = start_cspm([*words, "--json", str(out / "diagnosis.json")], {})
    looks = list(watched(child, lambda p: (p.memory_info().rss, sum(p.cpu_times()[:2]))))
    memory, processor = (max(column) for column in zip(*looks, strict=True))
    took = time.perf_counter() - begun
    step_us = 0.5 * (before + plant_step(machine))
    return Cost(took, processor, memory, 1e-3 * PERIOD_NS / step_us)


if __name__ == "__main__":
    main()
