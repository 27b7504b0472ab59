"""What one run of the thesis's seas came to, and the table that keeps all of them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.results.tracking import Case
from cspm_control.analysis.cable_groups import cable_groups
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS

Array = NDArray[np.float64]

WANTED_TENSION = 2.0 + 1e-6  # N
GROUPS = ("hoist", "surge", "sway")
_ERRORS = [f"{kind}_{dof}" for kind in ("rms", "largest") for dof in DOFS]
_TENSIONS = [f"{kind}_{group}" for kind in ("low", "least") for group in GROUPS]
_NUMBERS = [*_ERRORS, "within", "within_six", "least_tension", *_TENSIONS]


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
        least: tension [N], of any cable.
        least_of: the same by group of cables; `low` and this are nan in runs older than they are.
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
    least_of: Mapping[str, float]
    failure: str


def measure(case: str, scenario: str, overrides: Sequence[str], seed: int) -> Outcome:
    """Run a scenario with one seed."""
    run = Case(scenario, (*overrides, f"seed={seed}"))
    bundle = run.bundle()
    errors, tensions, _, failure = run.run()
    requirement = bundle.scenario.requirement
    kept = np.abs(errors) <= np.repeat([requirement.position, requirement.angle], 3)
    groups = cable_groups(bundle.testbed.testbed.cable_names)
    low = tensions <= WANTED_TENSION
    return Outcome(
        case=case,
        seed=seed,
        duration=len(errors) / bundle.scenario.rates.plant,
        rms=np.sqrt((errors**2).mean(axis=0)),
        largest=np.abs(errors).max(axis=0),
        within=float(kept[:, list(CONTROLLED_AXES)].all(axis=1).mean()),
        within_six=float(kept.all(axis=1).mean()),
        low={name: float(low[:, i].any(axis=1).mean()) for name, i in groups.items()},
        least=float(tensions.min()),
        least_of={name: float(tensions[:, i].min()) for name, i in groups.items()},
        failure=failure,
    )


def write_csv(path: Path, found: Sequence[Outcome]) -> None:
    """Write every run, a row each, in SI units."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["case", "seed", "duration", *_NUMBERS, "failure"])
        for o in sorted(found, key=lambda each: (each.case, each.seed)):
            tensions = [kind[group] for kind in (o.low, o.least_of) for group in GROUPS]
            numbers = (*o.rms, *o.largest, o.within, o.within_six, o.least, *tensions)
            cells = ["" if np.isnan(value) else f"{value:.6g}" for value in numbers]
            rows.writerow([o.case, o.seed, o.duration, *cells, o.failure])


def read_csv(path: Path) -> list[Outcome]:
    """Return the runs that `write_csv` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        return [_outcome(row) for row in csv.DictReader(file)]


def _outcome(row: Mapping[str, str]) -> Outcome:
    values = {name: float(row[name] or "nan") for name in _NUMBERS}
    return Outcome(
        case=row["case"],
        seed=int(row["seed"]),
        duration=float(row["duration"]),
        rms=np.array([values[f"rms_{dof}"] for dof in DOFS]),
        largest=np.array([values[f"largest_{dof}"] for dof in DOFS]),
        within=values["within"],
        within_six=values["within_six"],
        low={group: values[f"low_{group}"] for group in GROUPS},
        least=values["least_tension"],
        least_of={group: values[f"least_{group}"] for group in GROUPS},
        failure=row["failure"],
    )
