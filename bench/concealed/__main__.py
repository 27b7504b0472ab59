"""Conceal effects in real recordings, and score what methods name: `python -m bench.concealed`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench.blind.commands import progress_bar
from bench.blind.jobs import jobs_of
from bench.blind.scoring.method import CSPM, require_method
from bench.blind.stored_results import read_results
from bench.concealed.case import QUICK_SIZES, SIZES, Case, cases_of, conceal, item_of
from bench.concealed.diagnose_all import diagnose_all
from bench.concealed.machine import machines
from bench.concealed.page import board, draw_curve, misses
from bench.concealed.score import SCHEMA, judged, read_own
from cspm_msgs_py.errors import CspmError, InputError
from cspm_run.output.console import make_console, say

_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
Found = list[tuple[Case, Path]]


def main() -> int:
    """Run the command line."""
    given = _parser().parse_args()
    try:
        _run(given)
    except CspmError as err:
        print(f"python -m bench.concealed: {err.line}", file=sys.stderr)
        return err.exit_code
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench.concealed", description=__doc__)
    add = parser.add_argument
    add("folders", nargs="+", type=Path, metavar="DIR", help="with what `cspm data get` fetched")
    add("--quick", action="store_true", help="sizes 0, 1 and 4 only")
    add("--method", action="append", metavar="NAME", help="repeated; otherwise cspm alone")
    add("--case", action="append", metavar="NAME", help="only these; repeated")
    add("--jobs", type=int, metavar="NUMBER", help="at a time; otherwise one per processor")
    add("--out", type=Path, default=Path("concealed"), metavar="DIR", help="results are kept here")
    add("--score", action="append", type=Path, default=[], metavar="FILE", help="of anybody")
    add("--json", type=Path, metavar="FILE", help="write cases and outcomes")
    add("--page", type=Path, metavar="FILE", help="write board and misses as Markdown")
    add("--picture", type=Path, metavar="FILE", help="draw the curve as PNG")
    add("--export", type=Path, metavar="DIR", help="write what methods are given, and end")
    return parser


def _run(given: argparse.Namespace) -> None:
    methods = given.method or [CSPM]
    for method in methods:
        require_method(method)
    console = make_console()
    cases, items = _cases(given)
    if given.export is not None:
        _export(cases, given.export)
        say(console, f"{given.export}: {len(cases)} cases")
        return
    for name in _THREADS:
        os.environ.setdefault(name, "1")
    with progress_bar(console) as show:
        diagnose_all(cases, given.out, methods, jobs_of(given.jobs), show)
    known = {case.machine.name: case.machine.known for case, _ in cases}
    names = [item["name"] for item in items]
    results = {method: _stored(given.out, names, method) for method in methods}
    results |= dict(read_own(path, names) for path in given.score)
    outcomes = {method: judged(items, own, known) for method, own in results.items()}
    first = outcomes[methods[0]]
    page = f"{board(outcomes)}\n\nWhat {methods[0]} misses:\n\n{misses(first)}\n"
    print(page)
    if given.page is not None:
        given.page.write_text(page, encoding="utf-8")
    if given.picture is not None:
        draw_curve(given.picture, first)
    if given.json is not None:
        content = {m: [asdict(o) for o in own] for m, own in outcomes.items()}
        data = {"schema": SCHEMA, "cases": items, "outcomes": content}
        given.json.write_text(json.dumps(data, indent=1), encoding="utf-8")


def _cases(given: argparse.Namespace) -> tuple[Found, list[dict[str, Any]]]:
    """Return the cases of the data that are there, and their truth."""
    found, items, absent = [], [], []
    for machine in machines():
        place = machine.dataset.place(given.folders)
        if place is None:
            absent.append(machine.dataset.folder)
            continue
        for case in cases_of(machine, QUICK_SIZES if given.quick else SIZES):
            if given.case and case.name not in given.case:
                continue
            item = item_of(case, place)
            if item is not None:
                found.append((case, place))
                items.append(item)
    if not found:
        raise InputError(
            f"{given.folders[0]}: no case, allowed: a folder with {', '.join(sorted(set(absent)))}"
            if absent
            else f"--case {given.case[0]}: no such case"
        )
    return found, items


def _stored(folder: Path, names: Sequence[str], method: str) -> dict[str, Any]:
    results = read_results(folder, None, method)
    return {name: results[name] for name in names if name in results}


def _export(cases: Found, folder: Path) -> None:
    """Write tables, test-bed file, mapping and recordings of cases, without their truth."""
    for case, place in cases:
        room = folder / case.name
        room.mkdir(parents=True)
        conceal(case, place, room)


if __name__ == "__main__":
    sys.exit(main())
