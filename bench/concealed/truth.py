"""What is true of each machine: least squares of its terms, run by run.

`python -m bench.concealed.truth DIR` prints what `machines.yaml` has as `inertia`, `terms`,
`unexplained` and `repeats`. Nothing of a diagnosis is used.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from bench.concealed.machine import INERTIA, Machine
from bench.concealed.machine_table import print_machine_table
from bench.real.least_squares import least_squares
from cspm_ident.signals.measurement import read_measurement

_OFFSET = "winch_torque_offset"


def runs_of(machine: Machine, place: Path) -> list[tuple[str, ...]]:
    """Return a row of the table for each run of a machine."""
    terms = [*machine.terms, INERTIA, _OFFSET]
    bare = machine.content | {"effects": []}
    rows = []
    with tempfile.TemporaryDirectory() as room:
        imported = machine.dataset.imported(place, Path(room), description=bare)
        for folder in (each for part in imported for each in part):
            run = [read_measurement(folder)]
            found = least_squares(run, run, terms)
            amounts = found.amounts | {INERTIA: _more(found.amounts[INERTIA], machine.inertia)}
            words = "; ".join(
                f"{effect} {name} {value:.4g}"
                for effect, parameters in amounts.items()
                for name, value in parameters.items()
            )
            rows.append((machine.name, folder.name, words, f"{found.unexplained:.4g}"))
    return rows


def _more(parameters: dict[str, float], inertia: float) -> dict[str, float]:
    return {name: inertia + value for name, value in parameters.items()}


def main() -> None:
    """Run the command line."""

    def wanted(machine: Machine, place: Path) -> list[tuple[str, ...]]:
        return runs_of(machine, place) if machine.inertia else []

    heads = ("machine", "run", "least squares", "unexplained [N·m]")
    print_machine_table("bench.concealed.truth", __doc__, heads, wanted)


if __name__ == "__main__":
    main()
