"""Diagnose recordings in processes that are given nothing else to read."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from cspm_bringup.blind.truth import RECORDINGS, results_of
from cspm_ident.blind.method import CSPM, require_method
from cspm_msgs_py.errors import InputError

DIAGNOSIS, TIMES, FAILURE = "diagnosis.json", "times.json", "failure.txt"
_KEPT = ("PATH", "LANG", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")

Tell = Callable[[str, int, int], None]


def run(
    folder: Path,
    tell: Tell = lambda text, done, total: None,
    methods: Sequence[str] = (CSPM,),
) -> dict[str, str]:
    """Diagnose every recording without a result; return what failed, with the reason.

    Each result is there whole or not at all, so that an interrupted run goes on where it was.

    Args:
        folder: the benchmark's.
        tell: called with what is being done, how much of it is done, and how much there is.
        methods: of `METHODS`, each confined with the others to one process per recording.

    Raises:
        InputError: no recordings there, no such method, or one whose packages are not there.
    """
    for method in methods:
        require_method(method)
    recordings = folder / RECORDINGS
    places = sorted(recordings.iterdir()) if recordings.is_dir() else []
    # A folder is empty where the controllers lost the bar.
    names = [place.name for place in places if any(place.iterdir())]
    if not names:
        raise InputError(f"{folder}: no {RECORDINGS}, allowed: a folder of `cspm blind make`")
    failed = {}
    for done, name in enumerate(names):
        tell(f"diagnosing {name}", done, len(names))
        places = [results_of(folder, method) / name for method in methods]
        missing = {m: place for m, place in zip(methods, places, strict=True) if not place.exists()}
        if missing:
            _diagnose(recordings / name, missing)
        for method, place in zip(methods, places, strict=True):
            if (place / FAILURE).exists():
                reason = (place / FAILURE).read_text(encoding="utf-8").splitlines()[-1]
                failed[name if method == CSPM else f"{name}, {method}"] = reason
    tell("diagnosed", len(names), len(names))
    return failed


def _diagnose(recording: Path, places: Mapping[str, Path]) -> None:
    """Diagnose a recording; results go to the place of each method."""
    with tempfile.TemporaryDirectory(prefix="cspm-blind-") as room:
        copy = Path(room) / recording.name
        shutil.copytree(recording, copy)
        begun = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "cspm_bringup.blind.confined", copy.name, *places],
            cwd=room,
            env=environment(Path(room)),
            capture_output=True,
            text=True,
            check=False,
        )
        wall = time.perf_counter() - begun
        said = done.stderr.strip() or f"exit {done.returncode}, nothing said"
        for method, place in places.items():
            _keep(Path(room), method, place, said, wall)


def _keep(room: Path, method: str, place: Path, said: str, wall: float) -> None:
    """Keep what a process has left of one method, whole."""
    part = place.with_name(f".part-{place.name}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    report, reason = room / f"{method}.json", room / f"{method}.txt"
    times = {"wall_s": wall, "cpu_s": 0.0}
    if report.exists():
        content = json.loads(report.read_text(encoding="utf-8"))
        times["cpu_s"] = content["cpu_s"]
        told = json.dumps(content["diagnosis"], indent=2)
        (part / DIAGNOSIS).write_text(told, encoding="utf-8")
    else:
        why = reason.read_text(encoding="utf-8") if reason.exists() else said
        (part / FAILURE).write_text(f"{why.strip()}\n", encoding="utf-8")
    (part / TIMES).write_text(json.dumps(times), encoding="utf-8")
    part.rename(place)


def environment(room: Path) -> dict[str, str]:
    """Return what a confined process knows of its surroundings: the code, and its own room."""
    kept = {name: os.environ[name] for name in (*_KEPT, *_THREADS) if name in os.environ}
    code = str(Path(__file__).resolve().parents[2])
    home = {"HOME": str(room), "TMPDIR": str(room), "MPLCONFIGDIR": str(room)}
    return kept | home | {"PYTHONPATH": code, "PYTHONSAFEPATH": "1"}
