"""Whether tests notice a wrong sign, threshold or unit: `python -m bench.mutations [NAME …]`.

Each mutation changes one line in a copy of the checkout and runs the tests that have to notice it.
A mutation that they let pass is a line that nothing holds.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from cspm_msgs_py.new_folder import ScratchFolder

ROOT = Path(__file__).resolve().parents[1]
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


class Mutation(NamedTuple):
    """One line made wrong.

    Attributes:
        name: what is wrong then.
        file: path in the checkout.
        old: text that occurs once in the file.
        new: what replaces it.
        tests: path of the tests that have to fail.
    """

    name: str
    file: str
    old: str
    new: str
    tests: str


MUTATIONS = (
    Mutation(
        "sign: a cable's tension drives its winch",
        "cspm_sim/kernels/winch.py",
        "limited - cables[i, RADIUS] * tension",
        "limited + cables[i, RADIUS] * tension",
        "tests/cspm_sim/test_plant_winch.py",
    ),
    Mutation(
        "sign: a moving frame lengthens its cables",
        "cspm_model/kernels/kinematics.py",
        "frame[i, 2] = -ux, -uy, -uz",
        "frame[i, 2] = ux, uy, uz",
        "tests/cspm_model/test_kinematics.py",
    ),
    Mutation(
        "sign: the weight is pushed down, not held",
        "cspm_control/controllers/motion_controller.py",
        "out[2] -= weight",
        "out[2] += weight",
        "tests/cspm_control/controllers/test_motion_controller.py",
    ),
    Mutation(
        "limit: angles are compared the longer way round",
        "cspm_control/controllers/motion_controller.py",
        "floor(angle / (2.0 * pi) + 0.5)",
        "floor(angle / (2.0 * pi))",
        "tests/cspm_control/controllers/test_motion_controller.py",
    ),
    Mutation(
        "unit: revolutions per minute are taken per second",
        "cspm_ident/importing/units.py",
        '"rpm": _TURN / 60.0',
        '"rpm": _TURN',
        "tests/cspm_ident/importing/test_import_mapping.py",
    ),
    Mutation(
        "unit: an input is stale after ms instead of s",
        "cspm_control/safety.py",
        "round(safety.stale_after * 1e9)",
        "round(safety.stale_after * 1e6)",
        "tests/cspm_control/test_safety.py",
    ),
    Mutation(
        "sign: a sensor's sample arrives before it is taken",
        "cspm_sim/sensors.py",
        "(step + self.delay_steps, now_ns, sample)",
        "(step - self.delay_steps, now_ns, sample)",
        "tests/cspm_sim/test_sensors.py",
    ),
    Mutation(
        "threshold: a colour's order costs nothing",
        "cspm_ident/estimation/autoregression.py",
        "np.log(variance) + 2.0 * order",
        "np.log(variance) + 0.0 * order",
        "tests/cspm_ident/estimation/test_autoregression.py",
    ),
    Mutation(
        "threshold: chance counts as certain on what was held out",
        "cspm_ident/diagnosis/validation/holdout_degradation.py",
        "< -thresholds.certain_sigma * whole.error",
        "< 0.0 * whole.error",
        "tests/cspm_ident/diagnosis/validation/test_diagnosis_harm.py",
    ),
    Mutation(
        "threshold: each candidate has all false alarms to itself",
        "cspm_ident/diagnosis/regression/significance.py",
        "/ (self._tried[effect.id] * len(self._tried))",
        "/ len(self._tried)",
        "tests/cspm_ident/diagnosis/regression/test_diagnosis_significance.py",
    ),
)


class Result(NamedTuple):
    """What tests made of a mutation: the first that failed, none if all passed."""

    mutation: Mutation
    noticed_by: str | None


def mutated(text: str, mutation: Mutation) -> str:
    """Return a file's text with the mutation.

    Raises:
        ValueError: the text to replace does not occur exactly once.
    """
    found = text.count(mutation.old)
    if found != 1:
        raise ValueError(f"{mutation.file}: {mutation.old!r} occurs {found} times, allowed: once")
    return text.replace(mutation.old, mutation.new)


def try_mutation(copy: Path, mutation: Mutation) -> Result:
    """Run tests on a copy of the checkout that has the mutation; the copy is as before afterwards.

    Raises:
        RuntimeError: the tests could not be run.
        ValueError: the text to replace does not occur exactly once.
    """
    file = copy / mutation.file
    before = file.read_text(encoding="utf-8")
    file.write_text(mutated(before, mutation), encoding="utf-8")
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", mutation.tests],
            cwd=copy,
            env=os.environ | {"PYTHONPATH": str(copy)},
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        file.write_text(before, encoding="utf-8")
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{mutation.tests}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    failed = _FAILED.search(done.stdout)
    return Result(mutation, failed[1] if failed and done.returncode else None)


def copy_checkout(target: Path) -> None:
    """Copy the files of the checkout that are under version control."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)


def table_of(results: Sequence[Result]) -> Table:
    """Return a table with a row for each mutation."""
    table = Table("mutation", "file", "noticed by")
    for mutation, noticed_by in results:
        table.add_row(mutation.name, mutation.file, noticed_by or "[red]nothing[/]")
    return table


def main() -> int:
    """Run the command line; return 1 if a mutation passes all tests."""
    parser = argparse.ArgumentParser(prog="python -m bench.mutations", description=__doc__)
    parser.add_argument("words", nargs="*", metavar="WORD", help="of the names; otherwise all")
    words = parser.parse_args().words
    chosen = [m for m in MUTATIONS if not words or any(word in m.name for word in words)]
    with ScratchFolder("mutations") as place:
        copy_checkout(place)
        results = [try_mutation(place, mutation) for mutation in chosen]
    Console().print(table_of(results))
    return int(any(result.noticed_by is None for result in results))


if __name__ == "__main__":
    sys.exit(main())
