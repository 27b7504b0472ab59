"""Stored diagnoses of a benchmark."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.blind.diagnose_all import DIAGNOSIS, TIMES
from bench.blind.scoring.method import CSPM
from bench.blind.truth import results_of
from cspm_msgs_py.errors import InputError


def tried(folder: Path, methods: Sequence[str]) -> list[str]:
    """Return those methods that have results of a benchmark."""
    return [method for method in methods if results_of(folder, method).is_dir()]


def read_results(
    folder: Path, names: Sequence[str] | None, method: str = CSPM
) -> Mapping[str, Mapping[str, Any]]:
    """Return, by recording, `diagnosis` (None: it failed) and `times`; only what was diagnosed.

    Args:
        folder: the benchmark's.
        names: of the truth; None: any.
        method: whose results.

    Raises:
        InputError: there are no results, or they are of another benchmark.
    """
    place = results_of(folder, method)
    found = sorted(p.name for p in place.iterdir() if p.name[0] != ".") if place.is_dir() else []
    if not found:
        raise InputError(
            f"{folder}: no {place.name}, allowed: a folder after `python -m bench.blind run`"
        )
    strange = sorted(set(found) - set(found if names is None else names))
    if strange:
        raise InputError(f"{place}: {strange[0]} is not in the truth, allowed: its own recordings")
    return {name: _read(place / name) for name in found}


def _read(place: Path) -> dict[str, Any]:
    times = json.loads((place / TIMES).read_text(encoding="utf-8"))
    report = place / DIAGNOSIS
    diagnosis = json.loads(report.read_text(encoding="utf-8")) if report.exists() else None
    return {"diagnosis": diagnosis, "times": times}
