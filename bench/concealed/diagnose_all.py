"""Diagnose all cases by several methods; each result is there whole or not at all."""

from __future__ import annotations

import json
import shutil
import tempfile
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from bench.blind.diagnose_all import DIAGNOSIS, FAILURE, TIMES
from bench.blind.scoring.method import Methods
from bench.blind.truth import results_of
from bench.concealed.case import Case, conceal

Tell = Callable[[str, int, int], None]


def diagnose_all(
    cases: Sequence[tuple[Case, Path]],
    out: Path,
    methods: Sequence[str],
    jobs: int,
    tell: Tell = lambda text, done, total: None,
) -> None:
    """Diagnose what has no result yet, so that an interrupted run goes on where it was.

    Args:
        cases: each with its data set's folder.
        out: for the results.
        methods: of `bench.blind.scoring.method.METHODS`.
        jobs: cases at a time.
        tell: called with what is done, how many are done, and how many there are.
    """
    missing = [(case, place, _lacking(case, out, methods)) for case, place in cases]
    missing = [each for each in missing if each[2]]
    tell(f"{len(cases) - len(missing)} cases have results already", 0, len(missing))
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        begun = {pool.submit(_diagnosed, *each, out): each[0].name for each in missing}
        for done, task in enumerate(as_completed(begun), start=1):
            task.result()
            tell(begun[task], done, len(missing))


def _lacking(case: Case, out: Path, methods: Sequence[str]) -> list[str]:
    return [each for each in methods if not (results_of(out, each) / case.name).exists()]


def _diagnosed(case: Case, place: Path, methods: Sequence[str], out: Path) -> None:
    """Conceal, and let methods see what is left: recordings and test-bed file."""
    with tempfile.TemporaryDirectory(prefix="cspm-concealed-") as room:
        searched, held_out = conceal(case, place, Path(room))
        bench = Methods(searched, held_out)
        for method in methods:
            _keep(bench, method, results_of(out, method) / case.name)


def _keep(bench: Methods, method: str, place: Path) -> None:
    part = place.with_name(f".part-{place.name}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    seconds = 0.0
    try:
        reported, seconds = bench.diagnosis_by(method)
        (part / DIAGNOSIS).write_text(json.dumps(reported, indent=2), encoding="utf-8")
    except Exception:  # other methods and cases go on; the reason is kept
        (part / FAILURE).write_text(traceback.format_exc(), encoding="utf-8")
    (part / TIMES).write_text(json.dumps({"cpu_s": seconds}), encoding="utf-8")
    part.rename(place)
