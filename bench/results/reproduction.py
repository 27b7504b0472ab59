"""Tables 8-1 and 8-2 beside ours, over seeds: `python -m bench.results.reproduction`.

Runs the thesis's two seas under its controllers and past them, writes the tables of docs/results.md
and every run into results/reproduction.csv. Some fifty minutes on two processors. `--cases NAME …`
runs these alone and keeps the other rows; without a name the tables are written from what is kept.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from bench.page import into_page
from bench.results.outcome import Outcome, measure, read_csv, write_csv
from bench.results.reproduction_tables import (
    deep_block,
    factor_block,
    hoist_block,
    largest_block,
    once_block,
    past_block,
    spread_block,
)
from bench.results.tracking import Case
from cspm.campaign.cluster import worker_pool
from cspm_msgs_py.scenario import MotionControl, load_scenario
from cspm_run.library import find_scenario

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results.md"
TABLE = ROOT / "results" / "reproduction.csv"
# The thesis simulates without sensor noise.
IDEAL = "sensors=ideal"
SEEDS = 20
FEW = 5  # where a tendency is enough
ONCE = {
    "calm": ("calm", (IDEAL,)),
    "calm, with sensor noise": ("calm", ()),
    "calm, 4 m": ("calm_4m", (IDEAL,)),
    "calm, table 1-3 in full": (
        "calm",
        (
            IDEAL,
            "winch_frame.motion.amplitudes=[0.0188, 0.0088, 0.0248, 0.0067, 0.0065, 0.0033]",
            "target.motion.amplitudes=[0.1105, 0.0865, 0.318, 0.027, 0.2164, 0.1068]",
        ),
    ),
}
WORST, DEEP = "worst case", "worst case, 4 m"
PAST = "`worst_case_past_thesis`"
SIX = "`worst_case_six_dof`"
HIGHER = f"{PAST}, tensions from 2 N"
# Bandwidths of the hoists' force loops [rad/s] and the part of the run that figure 8-6 shows [s].
HOIST_LOOPS = (1000, 400, 200, 100)
FIGURE_8_6 = "duration=80.0"


class Job(NamedTuple):
    """A run to make; as for `measure`."""

    case: str
    scenario: str
    overrides: tuple[str, ...]
    seed: int


def jobs(seeds: int = SEEDS) -> list[Job]:
    """Return every run of the page."""
    once = [
        Job(name, scenario, overrides, load_scenario(find_scenario(scenario)).seed)
        for name, (scenario, overrides) in ONCE.items()
    ]
    spread = {
        WORST: ("worst_case", (IDEAL,)),
        DEEP: ("worst_case_4m", (IDEAL,)),
        **{_hoists(loop): ("worst_case", _slow_hoists(loop)) for loop in HOIST_LOOPS},
        PAST: ("worst_case_past_thesis", ()),
        HIGHER: ("worst_case_past_thesis", ("control.tension_distribution.lower_limit=2.0",)),
        SIX: ("worst_case_six_dof", ()),
    }
    few = {HIGHER, *map(_hoists, HOIST_LOOPS)}
    return once + [
        Job(name, *what, seed)
        for name, what in spread.items()
        for seed in range(1, (min(FEW, seeds) if name in few else seeds) + 1)
    ]


def _hoists(bandwidth: int) -> str:
    return f"{bandwidth} rad/s"


def _slow_hoists(bandwidth: int) -> tuple[str, ...]:
    """Return the overrides of slower hoist loops below the motion loops of `worst_case`."""
    control = Case("worst_case", (IDEAL,)).bundle().scenario.control
    motion = getattr(control, "motion", None)
    assert isinstance(motion, MotionControl)
    gains = ", ".join(
        f"{dof}: {{kp: {g.kp:.6g}, ki: {g.ki:.6g}, kd: {g.kd:.6g}}}"
        for dof, g in (motion.gains or {}).items()
    )
    loops = f"control.force.bandwidth={{hoist: {bandwidth}, surge: 1000, sway: 1000}}"
    return IDEAL, FIGURE_8_6, f"control.motion.gains={{{gains}}}", loops


def blocks(found: Sequence[Outcome]) -> dict[str, str]:
    """Return the tables of the page by their marks."""
    of = {
        name: [o for o in found if o.case == name] for name in dict.fromkeys(o.case for o in found)
    }
    return {
        "table 8-1": once_block({name: of[name][0] for name in ONCE}),
        "table 8-2": spread_block(of[WORST]),
        "table 8-2, largest": largest_block(of[WORST]),
        "factors": factor_block(of["calm"][0], of[WORST]),
        "hoists": hoist_block({_hoists(loop): of[_hoists(loop)] for loop in HOIST_LOOPS}),
        "deep": deep_block(of[DEEP]),
        "past": past_block({name: of[name] for name in (PAST, HIGHER, SIX)}, SIX),
    }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.results.reproduction")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--cases", nargs="*", help="run these alone; other rows are kept")
    options = parser.parse_args()
    wanted = [j for j in jobs(options.seeds) if options.cases is None or j.case in options.cases]
    made = {job.case for job in wanted}
    found = [o for o in read_csv(TABLE) if o.case not in made] if options.cases is not None else []
    console = Console()
    with worker_pool(options.workers) as pool:
        futures = [pool.submit(measure, *job) for job in wanted]
        for done, future in enumerate(as_completed(futures), 1):
            found.append(future.result())
            console.print(f"{done} of {len(wanted)}: {found[-1].case}, seed {found[-1].seed}")
    write_csv(TABLE, found)
    for name, text in blocks(found).items():
        into_page(PAGE, name, text)
    console.print(f"written {PAGE}, {TABLE}")


if __name__ == "__main__":
    main()
