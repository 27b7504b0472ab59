"""How often the diagnosis raises an alarm on a healthy machine.

`python -m bench.accuracy.healthy_machines [--processes N] [--folder FOLDER]` simulates ten machines
and seas, ten recordings each of 6 to 60 s, and diagnoses each beside its own test-bed file. An
alarm is any verdict but `consistent` and `not_excited`. Verdicts in FOLDER are not found again.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import cspm
from bench.blind.scoring.share import share_of, share_words, upper_bound
from cspm.campaign.cluster import worker_pool

SCENARIOS = (
    *("calm", "worst_case", "worst_case_steep", "worst_case_six_dof", "one_winch"),
    *("emps", "stadium_camera", "planar_kntu", "cogiro", "rig_damping_sway"),
)
DURATIONS = tuple(round(float(each), 1) for each in np.geomspace(6.0, 60.0, 10))
FIRST_SEED = 501
QUIET = ("consistent", "not_excited")
FOLDER = Path(".results/healthy_machines")


class Case(NamedTuple):
    """One recording: scenario, seed of sea and sensors, length [s]."""

    scenario: str
    seed: int
    duration: float

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.scenario}_{self.duration:g}s"


def cases(first_seed: int = FIRST_SEED) -> list[Case]:
    """Return all recordings, no two with the same seed, of which this is the first."""
    pairs = [(scenario, duration) for scenario in SCENARIOS for duration in DURATIONS]
    return [Case(scenario, first_seed + k, s) for k, (scenario, s) in enumerate(pairs)]


def verdict(case: Case, folder: Path) -> dict[str, str]:
    """Return a recording's verdict and sentence, from its file if it has one."""
    place = folder / f"{case.name}.json"
    if place.exists():
        stored: dict[str, str] = json.loads(place.read_text(encoding="utf-8"))
        return stored
    recording = folder / case.name
    if not recording.exists():
        longest = cspm.load_scenario(case.scenario).description.duration
        duration = min(case.duration, longest)
        cspm.simulate(case.scenario, seed=case.seed, duration=duration).save(recording)
    try:
        found = cspm.diagnose(recording, closed_loop=False).data
        statements = [each["statement"] for each in found["findings"]]
        said = {"verdict": found["verdict"], "sentence": " ".join(statements)}
    except cspm.InputError as refused:
        said = {"verdict": "refused", "sentence": str(refused)}
    place.write_text(json.dumps(said, ensure_ascii=False), encoding="utf-8")
    return said


def table_of(found: Mapping[Case, Mapping[str, str]]) -> Table:
    """Return a row per scenario: how many recordings have which verdict."""
    kinds = sorted({each["verdict"] for each in found.values()})
    table = Table("scenario", *kinds)
    for scenario in SCENARIOS:
        counts = Counter(v["verdict"] for case, v in found.items() if case.scenario == scenario)
        table.add_row(scenario, *(str(counts[kind]) for kind in kinds))
    return table


def alarms(found: Mapping[Case, Mapping[str, str]]) -> Sequence[Case]:
    """Return the recordings that were judged and raised an alarm."""
    return [case for case, v in found.items() if v["verdict"] not in (*QUIET, "refused")]


def main() -> None:
    """Simulate, diagnose, and print the alarms."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=1, help="diagnoses at a time")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="recordings and verdicts")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="others give fresh data")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    console, found = Console(), {}
    with worker_pool(options.processes) as pool:
        begun = {
            pool.submit(verdict, case, options.folder): case for case in cases(options.first_seed)
        }
        for done, each in enumerate(as_completed(begun), start=1):
            found[begun[each]] = each.result()
            console.print(f"{done} of {len(begun)}: {begun[each].name}: {each.result()['verdict']}")
    console.print(table_of(found))
    raised = alarms(found)
    for case in raised:
        console.print(f"{case.name}: {found[case]['sentence']}")
    judged = sum(each["verdict"] != "refused" for each in found.values())
    share = share_words(share_of(len(raised), judged))
    bound = 100.0 * upper_bound(len(raised), judged)
    console.print(f"alarms: {share}, one-sided bound of 95 %: {bound:.1f} %")


if __name__ == "__main__":
    main()
