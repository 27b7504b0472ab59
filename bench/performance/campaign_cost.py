"""What a campaign costs: the engine's overhead, and how it scales with workers.

Run `python -m bench.performance.campaign_cost`. Rows are timed from the end of the first run of
each worker on, so that start-up and the first imports do not count; they are shown apart.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from bench.performance.plant_speed import plant_step
from bench.performance.thesis_machine import PERIOD_NS, ThesisMachine, roll_damping
from cspm.campaign.campaign import run_campaign
from cspm_msgs_py.new_folder import ScratchFolder

# Of the plant, on the machine for which the goals were set.
REFERENCE_SPEED = 850.0
MANY = 10_000
_FILE = """\
scenario: {scenario}
set: {{duration: {duration}}}
grid: {{seed: {{from: 1, to: {runs}}}}}
"""


class Cost(NamedTuple):
    """What one campaign took.

    Attributes:
        workers: processes.
        start_s: until every worker had ended a run [s].
        per_run_s: wall time for each further run [s].
        overhead: share of the workers' time that was not spent in runs.
        processor_s: of one run, in the mean [s].
        plant_s: what the plant's steps of a run take alone, measured before and after [s].
    """

    workers: int
    start_s: float
    per_run_s: float
    overhead: float
    processor_s: float
    plant_s: float

    @property
    def times_plant(self) -> float:
        """A run's processor time in that of its plant's steps alone."""
        return self.processor_s / self.plant_s


def measured(scenario: str, duration: float, runs: int, workers: int) -> Cost:
    """Run a campaign of seeds, and return what it took.

    Args:
        scenario: of the library.
        duration: of each run [s].
        runs: how many.
        workers: processes.
    """
    ends: list[float] = []
    with ScratchFolder("campaign-cost") as place:
        file = place / "seeds.yaml"
        text = _FILE.format(scenario=scenario, duration=duration, runs=runs)
        file.write_text(text, encoding="utf-8")
        begun = time.perf_counter()

        def note(_: float, what: str) -> None:
            if what.startswith("run "):
                ends.append(time.perf_counter() - begun)

        machine = ThesisMachine(roll_damping())
        before = plant_step(machine)
        done = run_campaign(file, place / "out", workers=workers, progress=note)
        step = 0.5e-6 * (before + plant_step(machine))
    plant = step * duration / (PERIOD_NS * 1e-9)
    return _cost(workers, ends, done.rows, plant)


def _cost(
    workers: int, ends: Sequence[float], every: Sequence[Mapping[str, Any]], plant: float
) -> Cost:
    # The first runs of the workers, which import and compile, are those of the least numbers.
    rows = every[workers:]
    wall = ends[-1] - ends[workers - 1]
    busy = sum(row["elapsed_s"] for row in rows)
    mean = sum(row["processor_s"] for row in rows) / len(rows)
    overhead = 1.0 - busy / (workers * wall)
    return Cost(workers, ends[workers - 1], wall / len(rows), overhead, mean, plant)


def table_of(costs: list[Cost]) -> Table:
    """Return a row per campaign, and how its rate compares with that of the first."""
    heads = ("workers", "start [s]", "wall per run [s]", "processor per run [s]")
    table = Table(*heads, "of its plant's", "overhead", "times the first")
    for each in costs:
        table.add_row(
            str(each.workers),
            f"{each.start_s:.1f}",
            f"{each.per_run_s:.3f}",
            f"{each.processor_s:.3f}",
            f"{each.times_plant:.1f} ×",
            f"{each.overhead:.1%}",
            f"{costs[0].per_run_s / each.per_run_s:.2f}",
        )
    return table


def main() -> None:
    """Measure campaigns with one worker and with two, turn by turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="worst_case")
    parser.add_argument("--duration", type=float, default=60.0, help="of each run [s]")
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    costs = [
        measured(options.scenario, options.duration, options.runs, each) for each in options.workers
    ]
    console = Console()
    console.print(table_of(costs))
    last = costs[-1]
    here = MANY * last.per_run_s / 60.0
    faster = last.plant_s / (options.duration / REFERENCE_SPEED)
    console.print(
        f"{MANY} runs with {last.workers} workers: {here:.0f} min here; where the plant steps at"
        f" {REFERENCE_SPEED:g} × real time and all else likewise, {here / faster:.0f} min"
    )


if __name__ == "__main__":
    main()
