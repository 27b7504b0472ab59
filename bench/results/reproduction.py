"""Tables 8-1 and 8-2 beside ours, over seeds: `python -m bench.results.reproduction`.

Runs the thesis's two seas under its controllers and past them, writes the tables of docs/results.md
and every run into results/reproduction.csv. About half an hour on two processors.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from bench.markdown import markdown_table
from bench.page import into_page
from bench.results.result_tables import THESIS_TABLES
from bench.results.tracking import Case
from cspm.campaign.cluster import worker_pool
from cspm_control.analysis.cable_groups import cable_groups
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.scenario import load_scenario
from cspm_run.library import find_scenario

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results.md"
TABLE = ROOT / "results" / "reproduction.csv"
# The thesis simulates without sensor noise.
IDEAL = "sensors=ideal"
SEEDS = 20
PAST, SIX = "worst_case_past_thesis", "worst_case_six_dof"
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
    "worst case, 4 m": ("worst_case_4m", (IDEAL,)),
}
SPREAD = {"worst case": ("worst_case", (IDEAL,)), "past": (PAST, ()), "six": (SIX, ())}
WANTED_TENSION = 2.0 + 1e-6  # N


@dataclass(frozen=True)
class Outcome:
    """What one run came to.

    Attributes:
        case: name of what was run.
        seed: of the sea.
        duration: simulated [s].
        rms: pose errors (6,) [m, rad].
        largest: the same.
        within: share of time within the requirement, of the controlled coordinates.
        within_six: the same of all six.
        low: share of time at 2 N or less, by group of cables.
        least: tension [N].
        failure: why it ended early, or nothing.
    """

    case: str
    seed: int
    duration: float
    rms: Array
    largest: Array
    within: float
    within_six: float
    low: Mapping[str, float]
    least: float
    failure: str


def measure(case: str, scenario: str, overrides: Sequence[str], seed: int) -> Outcome:
    """Run a scenario with one seed."""
    run = Case(scenario, (*overrides, f"seed={seed}"))
    bundle = run.bundle()
    errors, tensions, _, failure = run.run()
    requirement = bundle.scenario.requirement
    kept = np.abs(errors) <= np.repeat([requirement.position, requirement.angle], 3)
    groups = cable_groups(bundle.testbed.testbed.cable_names)
    return Outcome(
        case=case,
        seed=seed,
        duration=len(errors) / bundle.scenario.rates.plant,
        rms=np.sqrt((errors**2).mean(axis=0)),
        largest=np.abs(errors).max(axis=0),
        within=float(kept[:, list(CONTROLLED_AXES)].all(axis=1).mean()),
        within_six=float(kept.all(axis=1).mean()),
        low={
            name: float((tensions[:, members] <= WANTED_TENSION).any(axis=1).mean())
            for name, members in groups.items()
        },
        least=float(tensions.min()),
        failure=failure,
    )


def once_block(found: Mapping[str, Outcome]) -> str:
    """Return table 8-1 beside ours."""
    names = [name for name in ONCE if name.startswith("calm")]
    largest, rms = THESIS_TABLES["calm"]
    rows = []
    for i, dof in enumerate(DOFS):
        unit = 1e3
        scale = 1.0 if i < 3 else 1e3
        ours = [f"{unit * found[n].rms[i]:.3g}, {unit * found[n].largest[i]:.3g}" for n in names]
        thesis = f"{scale * (rms[i] or 0.0):.3g}, {scale * (largest[i] or 0.0):.3g}"
        rows.append([f"{dof} [{'mm' if i < 3 else 'mrad'}]", thesis, *ours])
    low = [", ".join(f"{100 * v:.2g} %" for v in found[n].low.values()) for n in names]
    rows.append([f"time at 2 N: {', '.join(found['calm'].low)}", "surge only, once", *low])
    return markdown_table(["RMS, largest", "thesis", *names], rows)


def spread_block(found: Sequence[Outcome]) -> str:
    """Return table 8-2 beside the spread of ours over seeds."""
    _, rms = THESIS_TABLES["worst case"]
    ours = 1e3 * np.array([each.rms for each in found])
    rows = []
    for i, dof in enumerate(DOFS):
        thesis = (rms[i] or 0.0) * (1.0 if i < 3 else 1e3)
        low, high = np.percentile(ours[:, i], [5, 95])
        middle = float(np.exp(np.log(ours[:, i]).mean()))
        rank = int((ours[:, i] < thesis).sum())
        cells = f"{thesis:.3g}", f"{middle:.3g}", f"{low:.3g} to {high:.3g}"
        rows.append([f"{dof} [{'mm' if i < 3 else 'mrad'}]", *cells, f"{rank} of {len(found)}"])
    heads = [
        "RMS",
        "thesis",
        "ours, geometric mean",
        "5 to 95 % of seeds",
        "seeds below the thesis",
    ]
    return markdown_table(heads, rows)


def past_block(found: Mapping[str, Sequence[Outcome]]) -> str:
    """Return how the controllers past the thesis do over seeds."""
    rows = []
    for name, outcomes in found.items():
        shares = [o.within_six if name == SIX else o.within for o in outcomes]
        worst = 1e3 * np.array([o.rms for o in outcomes])[:, :3].max()
        rows.append(
            [
                f"`{name}`",
                f"{worst:.3g} mm",
                f"{sum(share >= 0.99 for share in shares)} of {len(shares)}",
                f"{100 * min(shares):.1f} %",
                f"{min(o.least for o in outcomes):.2f} N",
            ]
        )
    heads = ["", "largest RMS", "seeds within 99 % of the time", "worst seed", "least tension"]
    return markdown_table(heads, rows)


def write_csv(path: Path, found: Sequence[Outcome]) -> None:
    """Write every run, a row each, in SI units."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        heads = [f"{kind}_{dof}" for kind in ("rms", "largest") for dof in DOFS]
        shares = ["within", "within_six", "least_tension", "failure"]
        rows.writerow(["case", "seed", "duration", *heads, *shares])
        for o in sorted(found, key=lambda each: (each.case, each.seed)):
            values = [f"{v:.6g}" for v in (*o.rms, *o.largest, o.within, o.within_six, o.least)]
            rows.writerow([o.case, o.seed, o.duration, *values, o.failure])


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.results.reproduction")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    jobs = [(name, *what, _seed(what[0])) for name, what in ONCE.items()]
    jobs += [
        (name, *what, seed) for name, what in SPREAD.items() for seed in range(1, options.seeds + 1)
    ]
    console, found = Console(), []
    with worker_pool(options.workers) as pool:
        futures = [pool.submit(measure, *job) for job in jobs]
        for done, future in enumerate(as_completed(futures), 1):
            found.append(future.result())
            console.print(f"{done} of {len(jobs)}: {found[-1].case}, seed {found[-1].seed}")
    write_csv(TABLE, found)
    by_case = {name: [o for o in found if o.case == name] for name in (*ONCE, *SPREAD)}
    into_page(PAGE, "table 8-1", once_block({name: by_case[name][0] for name in ONCE}))
    into_page(PAGE, "table 8-2", spread_block(by_case["worst case"]))
    into_page(PAGE, "past", past_block({PAST: by_case["past"], SIX: by_case["six"]}))
    console.print(f"written {PAGE}, {TABLE}")


def _seed(scenario: str) -> int:
    return load_scenario(find_scenario(scenario)).seed


if __name__ == "__main__":
    main()
