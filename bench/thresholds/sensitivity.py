"""A recording diagnosed with one threshold moved, against the diagnosis with the defaults."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from bench.results.result_store import spoken
from bench.thresholds.development_set import Development, case_of, measured
from bench.thresholds.move import Move, moves, watched
from cspm.campaign.cluster import worker_pool
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.threshold_groups.reporting_thresholds import ReportingThresholds
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import CspmError

ROOT = Path(__file__).resolve().parents[2]
MADE_WITH = ("cspm_ident", "cspm_model", "cspm_sim")
REPORTING = {each.name for each in fields(ReportingThresholds)}
BASE = "default"
Data = Mapping[str, Any]
Tell = Callable[[str, int, int], None]


class Task(NamedTuple):
    """One diagnosis.

    Attributes:
        case: name of the recording.
        move: of which threshold; None: with the defaults.
    """

    case: str
    move: Move | None

    @property
    def file(self) -> str:
        """Name of the file that keeps what it found."""
        name = BASE if self.move is None else f"{self.move.name}={self.move.value:.6g}"
        return f"{self.case}/{name}.json"


@cache
def fingerprint() -> str:
    """Return a hash of the code that decides what a diagnosis finds."""
    digest = hashlib.sha256()
    for path in sorted(path for name in MADE_WITH for path in (ROOT / name).rglob("*.py")):
        digest.update(spoken(path.read_text(encoding="utf-8")).encode())
    return digest.hexdigest()[:12]


def diagnose_all(
    cases: Sequence[Development], folder: Path, processes: int, tell: Tell
) -> dict[str, dict[str, Any]]:
    """Diagnose recordings with the defaults and with every threshold moved; go on where it was.

    What is kept of each is in `folder`, whole or not at all. A threshold that the diagnosis with
    the defaults does not read changes nothing, so that it is not moved.

    Args:
        cases: recordings of the set.
        folder: of recordings and results.
        processes: diagnoses at a time.
        tell: called with what was done, how much of it is done, and how much there is.

    Returns:
        By file of `Task`, what was found.
    """
    with worker_pool(processes) as pool:
        base = [Task(case.name, None) for case in cases]
        found = _run(pool, base, folder, tell)
        moved = [
            Task(case.name, move)
            for case in cases
            for move in moves()
            if move.name in found[Task(case.name, None).file]["read"] and move.name not in REPORTING
        ]
        return found | _run(pool, moved, folder, tell)


def _run(
    pool: Executor, tasks: Sequence[Task], folder: Path, tell: Tell
) -> dict[str, dict[str, Any]]:
    code = fingerprint()
    begun = {pool.submit(kept, task, str(folder), code): task for task in tasks}
    found = {}
    for done, each in enumerate(as_completed(begun), start=1):
        found[begun[each].file] = each.result()
        tell(begun[each].file.removesuffix(".json"), done, len(tasks))
    return found


def kept(task: Task, folder: str, code: str) -> dict[str, Any]:
    """Return what a task found, from its file if there is one.

    Args:
        task: what to diagnose.
        folder: of recordings and results.
        code: what `fingerprint` returns.
    """
    place = Path(folder) / code / case_of(task.case).key / Path(task.file).name
    if place.exists():
        stored: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))
        return stored
    found = diagnosed(task, Path(folder) / "recordings")
    place.parent.mkdir(parents=True, exist_ok=True)
    unfinished = place.with_suffix(f".{os.getpid()}")
    unfinished.write_text(json.dumps(found), encoding="utf-8")
    os.replace(unfinished, place)
    return found


def diagnosed(task: Task, recordings: Path) -> dict[str, Any]:
    """Return a diagnosis as data, or why there is none.

    With the defaults also the names of thresholds that were read, and the data with each threshold
    of the report moved, which need no further search.
    """
    thresholds, read = watched()
    moved = thresholds if task.move is None else task.move.thresholds
    try:
        found = diagnose([_measured(task.case, recordings)], thresholds=moved)
    except CspmError as refused:
        return {"refused": str(refused), "read": sorted(read), "report": {}}
    names = sorted(read)
    data = _plain(diagnosis_data(found))
    if task.move is not None:
        return {"data": data}
    report = {
        f"{move.name}={move.value:.6g}": _plain(
            diagnosis_data(replace(found, thresholds=move.thresholds))
        )
        for move in moves()
        if move.name in REPORTING
    }
    return {"data": data, "read": names, "report": report}


@cache
def _measured(name: str, recordings: Path) -> Measurement:
    return measured(case_of(name), recordings)


def _plain(data: Data) -> dict[str, Any]:
    """Return a diagnosis without its thresholds, as JSON gives it back."""
    found: dict[str, Any] = json.loads(json.dumps(data))
    return {key: value for key, value in found.items() if key != "thresholds"}


def outcomes(found: Mapping[str, Mapping[str, Any]], case: str) -> Iterator[tuple[Move, str]]:
    """Yield each move of a threshold with what it changes in a recording's diagnosis.

    Args:
        found: what `diagnose_all` returns.
        case: name of the recording.
    """
    base = found[Task(case, None).file]
    for move in moves():
        name = Task(case, move).file
        if move.name in REPORTING:
            yield move, change(base["data"], base["report"][f"{move.name}={move.value:.6g}"])
        elif move.name not in base["read"]:
            yield move, "not read"
        elif "refused" in found[name]:
            yield move, "refused"
        else:
            yield move, change(base["data"], found[name]["data"])


def change(before: Data, after: Data) -> str:
    """Return what differs between two diagnoses: the most important of what does."""
    if before == after:
        return "nothing"
    if before["verdict"] != after["verdict"]:
        return f"verdict: {after['verdict']}"
    named = [[_named(each) for each in data["findings"]] for data in (before, after)]
    if sorted(named[0]) != sorted(named[1]):
        return f"findings: {_difference(*named)}"
    rivals = [[_rivals(each) for each in data["findings"]] for data in (before, after)]
    if sorted(rivals[0]) != sorted(rivals[1]):
        return "alternatives"
    return "numbers"


def _named(finding: Data) -> str:
    return f"{finding['effect']} on {', '.join(sorted(finding['elements']))}"


def _rivals(finding: Data) -> list[str]:
    return sorted(_named(each) for each in finding["alternatives"])


def _difference(before: Sequence[str], after: Sequence[str]) -> str:
    gone = [f"− {each}" for each in before if each not in after]
    new = [f"+ {each}" for each in after if each not in before]
    return ", ".join([*gone, *new]) or "another number of them"
